"""Reference trajectories of the quadrotor stack and the node that publishes them."""
