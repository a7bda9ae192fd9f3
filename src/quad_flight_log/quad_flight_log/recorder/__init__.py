"""The recorder: the node that writes every topic of a flight into one bag."""
