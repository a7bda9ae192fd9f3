"""The bag: written, read and exported without ROS."""
