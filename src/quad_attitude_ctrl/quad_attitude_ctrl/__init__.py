"""Attitude laws of the quadrotor stack (adaptive fast nonsingular integral terminal sliding mode) and their node."""
