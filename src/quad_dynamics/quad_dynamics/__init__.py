"""Plants, rotors, allocation and disturbances; the simulator node is ``quad_dynamics.node``."""
