"""Position laws of the quadrotor stack (adaptive integral backstepping) and their node."""
