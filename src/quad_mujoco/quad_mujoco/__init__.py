"""The quadrotor integrated by MuJoCo: a second plant, behind the same topics."""
