"""The parameters of a vehicle from logs of its flights, each with its interval and a verdict. Without ROS."""
