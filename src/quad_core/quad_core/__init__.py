"""ROS-free ground shared by every stage: types, parameters, rotations, vehicle, compilation."""
