"""Recorder node, bag reader and flight metrics of the quadrotor stack."""
