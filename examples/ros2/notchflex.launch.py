"""Launch file: `ros2 launch examples/ros2/notchflex.launch.py robot:=pacheco2021-a`."""

import sys
from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration

NODE = Path(__file__).with_name("notchflex_node.py")
ARGUMENTS = {"robot": "pacheco2021-a", "drive": "tension", "rate": "50.0"}


def generate_launch_description() -> LaunchDescription:
    """Run the node with its parameters."""
    parameters = []
    for name in ARGUMENTS:
        parameters += ["-p", [f"{name}:=", LaunchConfiguration(name)]]
    declared = [DeclareLaunchArgument(name, default_value=one) for name, one in ARGUMENTS.items()]
    command = [sys.executable, str(NODE), "--ros-args", *parameters]
    return LaunchDescription([*declared, ExecuteProcess(cmd=command, output="screen")])
