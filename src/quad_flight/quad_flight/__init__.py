"""A flight without ROS: set-up, loop, engine, score; and many of them."""
