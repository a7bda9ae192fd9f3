"""A vehicle that PX4 stabilises or only carries out: bridge between the flight's topics and uXRCE-DDS."""
