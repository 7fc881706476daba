"""Starts voxtile-ros2, a program on the PATH, with parameters.

    ros2 launch voxtile.launch.py output:=/maps/hall cloud:=/lidar/points params_file:=node.yaml
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

# Name, default and description of each argument. Empty values are not passed.
ARGUMENTS = [
    ("output", None, "Map folder; created if missing, continued if it exists"),
    ("cloud", "cloud_in", "Topic of clouds (sensor_msgs/PointCloud2)"),
    ("frame_id", "map", "Frame of the map"),
    ("params_file", "", "ROS 2 parameter file, also one of octomap_server"),
    ("metrics", "", "Port of /metrics and /health"),
    ("namespace", "", "Namespace of the node"),
    ("name", "voxtile_ros2", "Name of the node"),
    ("flush_timeout", "60", "Seconds that the last flush may take"),
]


def node(context):
    given = {name: LaunchConfiguration(name).perform(context) for name, _, _ in ARGUMENTS}
    options = ["-o", given["output"], "--cloud", given["cloud"], "--frame-id", given["frame_id"]]
    if given["metrics"]:
        options += ["--metrics", given["metrics"]]
    return [
        Node(
            executable="voxtile-ros2",
            name=given["name"],
            namespace=given["namespace"] or None,
            arguments=options,
            parameters=[given["params_file"]] if given["params_file"] else [],
            output="screen",
            # By default the node would be killed 10 s after Ctrl-C.
            sigterm_timeout=given["flush_timeout"],
            sigkill_timeout=given["flush_timeout"],
        )
    ]


def generate_launch_description():
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=description)
        for name, default, description in ARGUMENTS
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=node)])
