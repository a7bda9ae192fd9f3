"""A vehicle interface: a node that owns the vehicle of a flight."""
