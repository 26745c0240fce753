"""ROS 2, live: joint states in; estimates, diagnostics and what a controller can use out."""
