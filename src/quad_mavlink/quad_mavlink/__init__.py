"""A vehicle that PX4 or ArduPilot stabilises: bridge between the flight's topics and MAVLink over UDP."""
