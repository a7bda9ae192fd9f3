"""A Crazyflie: bridge between the flight's topics and the radio, by roll and pitch angle, yaw rate and thrust."""
