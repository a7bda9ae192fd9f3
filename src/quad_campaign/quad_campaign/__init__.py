"""Closed-loop flights of the quadrotor stack without ROS: sweeps and batches from the same code."""
