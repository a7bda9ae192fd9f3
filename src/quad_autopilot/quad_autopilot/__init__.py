"""What every bridge to an autopilot shares: frames, odometry, spacing of states, the way to the flight and back."""
