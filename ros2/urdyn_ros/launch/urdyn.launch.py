"""ros2 launch urdyn_ros urdyn.launch.py twin:=/path/to/twin.toml effort_unit:=A"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

ARGUMENTS = {"twin": "twin.toml", "out": "urdyn", "effort_unit": "", "serial": ""}


def generate_launch_description() -> LaunchDescription:
    """The node, with parameters of the package's file and what is named here."""
    share = Path(get_package_share_directory("urdyn_ros"))
    node = Node(
        package="urdyn_ros",
        executable="twin",
        name="urdyn",
        output="screen",
        parameters=[
            str(share / "config" / "urdyn.yaml"),
            {name: LaunchConfiguration(name) for name in ARGUMENTS},
        ],
    )
    declared = [DeclareLaunchArgument(name, default_value=d) for name, d in ARGUMENTS.items()]
    return LaunchDescription([*declared, node])
