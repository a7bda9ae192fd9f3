"""Launch files, configuration and the flight command of the quadrotor stack."""
