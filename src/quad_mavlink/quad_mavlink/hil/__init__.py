"""Our plants under an autopilot's simulator interface: sensors, motors, MAVLink over TCP, in lockstep."""
