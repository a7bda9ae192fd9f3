"""Logs of others (ULog, MAVLink, Crazyflie, rosbag2, CSV, Parquet) as bags of this project."""
