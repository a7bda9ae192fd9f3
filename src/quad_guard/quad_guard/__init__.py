"""The guard of a vehicle: every check, every threshold, and the backup law; pure functions without ROS."""
