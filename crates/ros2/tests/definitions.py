"""Definitions of types that the node uses and rosbags lacks, and hashes of all types that it uses."""

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

OUTCOME = "bool success\nstring message\n"
POINTS = "geometry_msgs/Point {}\ngeometry_msgs/Point {}\n"
HIT = OUTCOME + "bool hit\ngeometry_msgs/Point center\nfloat64 distance\nfloat64 probability\n"
OCTOMAP = "std_msgs/Header header\nbool binary\nstring id\nfloat64 resolution\nint8[] data\n"
EVENT_INFO = "uint8 event_type\nbuiltin_interfaces/Time stamp\nuint8[16] client_gid\nint64 sequence_number\n"

# Request and response. docs/ros2.md defines those of voxtile_msgs.
SERVICES = {
    "std_srvs/Trigger": ("", OUTCOME),
    "std_srvs/Empty": ("", ""),
    "octomap_msgs/BoundingBoxQuery": (POINTS.format("min", "max"), ""),
    "octomap_msgs/GetOctomap": ("", "octomap_msgs/Octomap map\n"),
    "voxtile_msgs/Snapshot": ("string name\n", OUTCOME),
    "voxtile_msgs/GetOctomapInBox": (
        POINTS.format("min", "max") + "bool binary\n",
        OUTCOME + "octomap_msgs/Octomap map\n",
    ),
    "voxtile_msgs/CastRay": (
        "geometry_msgs/Point origin\ngeometry_msgs/Vector3 direction\nfloat64 max_range\nbool unknown_is_obstacle\n",
        HIT,
    ),
    "voxtile_msgs/CheckCollision": (
        POINTS.format("from_point", "to_point") + "float64 radius\nbool unknown_is_obstacle\n",
        HIT,
    ),
    "nvblox_msgs/EsdfAndGradients": (
        "bool update_esdf\nbool visualize_esdf\nbool use_aabb\nstring frame_id\ngeometry_msgs/Point aabb_min_m\n"
        "geometry_msgs/Vector3 aabb_size_m\ngeometry_msgs/Point[] aabbs_to_clear_min_m\n"
        "geometry_msgs/Vector3[] aabbs_to_clear_size_m\ngeometry_msgs/Point[] spheres_to_clear_center_m\n"
        "float32[] spheres_to_clear_radius_m\n",
        "std_msgs/Header header\ngeometry_msgs/Point origin_m\nfloat32 voxel_size_m\n"
        "std_msgs/Float32MultiArray esdf_and_gradients\nbool success\n",
    ),
}
MESSAGES = [
    "sensor_msgs/PointCloud2",
    "tf2_msgs/TFMessage",
    "nav_msgs/Odometry",
    "nav_msgs/Path",
    "octomap_msgs/Octomap",
    "visualization_msgs/MarkerArray",
    "nav_msgs/OccupancyGrid",
    "geometry_msgs/PoseArray",
    "diagnostic_msgs/DiagnosticArray",
]


def full(name, kind):
    """Returns `std_msgs/msg/String` for `std_msgs/String`."""
    package, own = name.split("/")
    return f"{package}/{kind}/{own}"


def parts_of_services(text, name):
    """Returns definitions whose names contain `/srv/`, without the `msg` that rosbags inserts after it."""

    def plain(part):
        if isinstance(part, str):
            return part.replace("/srv/msg/", "/srv/")
        return type(part)(map(plain, part)) if type(part) in (tuple, list) else part

    return {plain(name): plain(fields) for name, fields in get_types_from_msg(text, name).items()}


def typestore():
    """Returns the definitions of ROS and of this file. A service consists of request, response and event (REP 2011)."""
    store = get_typestore(Stores.ROS2_JAZZY)
    store.register(get_types_from_msg(OCTOMAP, "octomap_msgs/msg/Octomap"))
    # ROS hashes `char` as `uint8`, its IDL type; rosbags does not.
    store.fielddefs.update(get_types_from_msg(EVENT_INFO, "service_msgs/msg/ServiceEventInfo"))
    for name, halves in SERVICES.items():
        own = full(name, "srv")
        for half, text in zip(["Request", "Response"], halves):
            store.register(parts_of_services(text, f"{own}_{half}"))
        event = f"service_msgs/ServiceEventInfo info\n{own}_Request[<=1] request\n{own}_Response[<=1] response\n"
        store.register(parts_of_services(event, f"{own}_Event"))
        fields = [("request_message", "Request"), ("response_message", "Response"), ("event_message", "Event")]
        whole = "".join(f"{own}_{half} {field}\n" for field, half in fields)
        store.register(parts_of_services(whole, own))
    return store


def hashes(store):
    """Returns the hash of each type that the node uses, by name."""
    names = [(name, "msg") for name in MESSAGES] + [(name, "srv") for name in SERVICES]
    return {name: store.hash_rihs01(full(name, kind)) for name, kind in names}
