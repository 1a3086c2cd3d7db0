"""A ROS 2 robot as a body of descry: `python3 -m descry_ros2 robot.toml`."""
