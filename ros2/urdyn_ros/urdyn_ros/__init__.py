"""urdyn beside a robot driver, where ROS 2 is sourced."""
