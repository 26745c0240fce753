"""ros2 launch urdyn_ros urdyn.launch.py twin:=/path/to/twin.toml effort_unit:=A"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

ARGUMENTS = {"twin": "twin.toml", "out": "urdyn", "effort_unit": "", "serial": ""}


def generate_launch_description() -> LaunchDescription:
    """The node, with parameters of the package's file and what is named here."""
    share = Path(get_package_share_directory("urdyn_ros"))
    # Texts whatever they look like: a serial number is all digits, and "" is no null.
    told = {name: ParameterValue(LaunchConfiguration(name), value_type=str) for name in ARGUMENTS}
    node = Node(
        package="urdyn_ros",
        executable="twin",
        name="urdyn",
        output="screen",
        parameters=[str(share / "config" / "urdyn.yaml"), told],
    )
    declared = [DeclareLaunchArgument(name, default_value=d) for name, d in ARGUMENTS.items()]
    return LaunchDescription([*declared, node])
