"""A flight without ROS: set-up, configuration, loop, engine, score and sweep."""
