"""The bag: written, read, checked, mended and converted without ROS."""
