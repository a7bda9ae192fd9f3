"""Plants and disturbances of the quadrotor stack and the simulator node."""
