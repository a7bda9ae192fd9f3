"""A stage between attitude law and plant: a low-pass of the torque."""
