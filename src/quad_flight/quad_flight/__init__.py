"""A flight without ROS: set-up, configuration, loop, engine, score; and many of them."""
