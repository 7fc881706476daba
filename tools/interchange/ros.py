"""Messages of ROS 1 and ROS 2 made with `rosbags`."""

import numpy as np
from rosbags.typesys import get_types_from_msg, get_typestore


class Ros:
    """Makes and serializes the messages of one ROS version."""

    def __init__(self, store, has_sequence):
        self.store, self.has_sequence = get_typestore(store), has_sequence
        if has_sequence:
            transforms = get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage")
            self.store.register(transforms)

    def make(self, name, *values):
        return self.store.types[name](*values)

    def header(self, stamp_ns, frame):
        stamp = self.make("builtin_interfaces/msg/Time", stamp_ns // 10**9, stamp_ns % 10**9)
        return self.make("std_msgs/msg/Header", *([0] if self.has_sequence else []), stamp, frame)

    def tf(self, stamp_ns, parent, child, pose):
        transform = self.make(
            "geometry_msgs/msg/Transform",
            self.make("geometry_msgs/msg/Vector3", *map(float, pose[:3])),
            self.make("geometry_msgs/msg/Quaternion", *map(float, pose[3:])),
        )
        link = self.make("geometry_msgs/msg/TransformStamped", self.header(stamp_ns, parent), child, transform)
        return self.make("tf2_msgs/msg/TFMessage", [link])

    def cloud(self, stamp_ns, xyz, intensity):
        field = lambda name, offset: self.make("sensor_msgs/msg/PointField", name, offset, 7, 1)
        fields = [field(name, 4 * k) for k, name in enumerate(["x", "y", "z", "intensity"])]
        data = np.column_stack([xyz, intensity]).astype("<f4").tobytes()
        data = np.frombuffer(data, dtype=np.uint8)
        return self.make(
            "sensor_msgs/msg/PointCloud2", self.header(stamp_ns, "lidar"), 1, len(xyz), fields, False, 16,
            len(data), data, True,
        )

    def serialize(self, message, name):
        if self.has_sequence:
            return bytes(self.store.serialize_ros1(message, name))
        return bytes(self.store.serialize_cdr(message, name))
