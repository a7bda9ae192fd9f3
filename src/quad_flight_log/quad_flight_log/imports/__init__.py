"""Logs of others (ULog, Crazyflie, rosbag2, CSV, Parquet) as bags of this project."""
