"""Many flights of the quadrotor stack without ROS: campaigns, statistics, tuning and studies."""
