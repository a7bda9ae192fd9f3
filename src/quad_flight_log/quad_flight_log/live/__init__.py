"""Visitors of a running flight: markers for RViz and Foxglove, and the live view. No node of the flight needs them."""
