"""The rclpy shell shared by all nodes."""
