"""Messages of ROS 2 for Cyclone DDS, written from their definitions, and the configuration of Cyclone DDS."""

import os

os.environ["CYCLONEDDS_URI"] = """<CycloneDDS><Domain><General><Interfaces>
<NetworkInterface address="127.0.0.1" multicast="false"/></Interfaces><AllowMulticast>false</AllowMulticast></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>
<Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>"""

from dataclasses import dataclass, make_dataclass

from cyclonedds.core import Policy
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float32, float64, int8, int32, int64, sequence, uint8, uint32, uint64
from cyclonedds.util import duration

BEST, RELIABLE = Policy.Reliability.BestEffort, Policy.Reliability.Reliable(duration(seconds=1))
VOLATILE, LATCHED = Policy.Durability.Volatile, Policy.Durability.TransientLocal


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class PointField(IdlStruct, typename="sensor_msgs::msg::dds_::PointField_"):
    name: str
    offset: uint32
    datatype: uint8
    count: uint32


@dataclass
class PointCloud2(IdlStruct, typename="sensor_msgs::msg::dds_::PointCloud2_"):
    header: Header
    height: uint32
    width: uint32
    fields: sequence[PointField]
    is_bigendian: bool
    point_step: uint32
    row_step: uint32
    data: sequence[uint8]
    is_dense: bool


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Transform(IdlStruct, typename="geometry_msgs::msg::dds_::Transform_"):
    translation: Vector3
    rotation: Quaternion


@dataclass
class TransformStamped(IdlStruct, typename="geometry_msgs::msg::dds_::TransformStamped_"):
    header: Header
    child_frame_id: str
    transform: Transform


@dataclass
class TFMessage(IdlStruct, typename="tf2_msgs::msg::dds_::TFMessage_"):
    transforms: sequence[TransformStamped]


@dataclass
class Octomap(IdlStruct, typename="octomap_msgs::msg::dds_::Octomap_"):
    header: Header
    binary: bool
    id: str
    resolution: float64
    data: sequence[int8]


@dataclass
class Point(IdlStruct, typename="geometry_msgs::msg::dds_::Point_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Pose(IdlStruct, typename="geometry_msgs::msg::dds_::Pose_"):
    position: Point
    orientation: Quaternion


@dataclass
class PoseArray(IdlStruct, typename="geometry_msgs::msg::dds_::PoseArray_"):
    header: Header
    poses: sequence[Pose]


@dataclass
class PoseWithCovariance(IdlStruct, typename="geometry_msgs::msg::dds_::PoseWithCovariance_"):
    pose: Pose
    covariance: array[float64, 36]


@dataclass
class Twist(IdlStruct, typename="geometry_msgs::msg::dds_::Twist_"):
    linear: Vector3
    angular: Vector3


@dataclass
class TwistWithCovariance(IdlStruct, typename="geometry_msgs::msg::dds_::TwistWithCovariance_"):
    twist: Twist
    covariance: array[float64, 36]


@dataclass
class Odometry(IdlStruct, typename="nav_msgs::msg::dds_::Odometry_"):
    header: Header
    child_frame_id: str
    pose: PoseWithCovariance
    twist: TwistWithCovariance


@dataclass
class PoseStamped(IdlStruct, typename="geometry_msgs::msg::dds_::PoseStamped_"):
    header: Header
    pose: Pose


@dataclass
class Path(IdlStruct, typename="nav_msgs::msg::dds_::Path_"):
    header: Header
    poses: sequence[PoseStamped]


@dataclass
class String(IdlStruct, typename="std_msgs::msg::dds_::String_"):
    data: str


@dataclass
class MapMetaData(IdlStruct, typename="nav_msgs::msg::dds_::MapMetaData_"):
    map_load_time: Time
    resolution: float32
    width: uint32
    height: uint32
    origin: Pose


@dataclass
class OccupancyGrid(IdlStruct, typename="nav_msgs::msg::dds_::OccupancyGrid_"):
    header: Header
    info: MapMetaData
    data: sequence[int8]


@dataclass
class ColorRGBA(IdlStruct, typename="std_msgs::msg::dds_::ColorRGBA_"):
    r: float32
    g: float32
    b: float32
    a: float32


@dataclass
class CompressedImage(IdlStruct, typename="sensor_msgs::msg::dds_::CompressedImage_"):
    header: Header
    format: str
    data: sequence[uint8]


@dataclass
class UVCoordinate(IdlStruct, typename="visualization_msgs::msg::dds_::UVCoordinate_"):
    u: float32
    v: float32


@dataclass
class MeshFile(IdlStruct, typename="visualization_msgs::msg::dds_::MeshFile_"):
    filename: str
    data: sequence[uint8]


@dataclass
class Marker(IdlStruct, typename="visualization_msgs::msg::dds_::Marker_"):
    header: Header
    ns: str
    id: int32
    type: int32
    action: int32
    pose: Pose
    scale: Vector3
    color: ColorRGBA
    lifetime: Time
    frame_locked: bool
    points: sequence[Point]
    colors: sequence[ColorRGBA]
    texture_resource: str
    texture: CompressedImage
    uv_coordinates: sequence[UVCoordinate]
    text: str
    mesh_resource: str
    mesh_file: MeshFile
    mesh_use_embedded_materials: bool


@dataclass
class MarkerArray(IdlStruct, typename="visualization_msgs::msg::dds_::MarkerArray_"):
    markers: sequence[Marker]


@dataclass
class KeyValue(IdlStruct, typename="diagnostic_msgs::msg::dds_::KeyValue_"):
    key: str
    value: str


@dataclass
class DiagnosticStatus(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticStatus_"):
    level: uint8
    name: str
    message: str
    hardware_id: str
    values: sequence[KeyValue]


@dataclass
class DiagnosticArray(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticArray_"):
    header: Header
    status: sequence[DiagnosticStatus]


@dataclass
class MultiArrayDimension(IdlStruct, typename="std_msgs::msg::dds_::MultiArrayDimension_"):
    label: str
    size: uint32
    stride: uint32


@dataclass
class MultiArrayLayout(IdlStruct, typename="std_msgs::msg::dds_::MultiArrayLayout_"):
    dim: sequence[MultiArrayDimension]
    data_offset: uint32


@dataclass
class Float32MultiArray(IdlStruct, typename="std_msgs::msg::dds_::Float32MultiArray_"):
    layout: MultiArrayLayout
    data: sequence[float32]


# Requests and responses of Cyclone DDS begin with the client's GUID and the sequence number.
MARKS = {"guid": uint64, "number": int64}


def service(package, name, request, response, marks):
    """Returns the request and response types."""
    kinds = []
    for kind, fields in [("Request", request), ("Response", response)]:
        fields = fields or {"structure_needs_at_least_one_member": uint8}
        namespace = {"__module__": __name__, "__idl_typename__": f"{package}::srv::dds_::{name}_{kind}_"}
        fields = list({**marks, **fields}.items())
        kinds.append(make_dataclass(f"{name}_{kind}", fields, bases=(IdlStruct,), namespace=namespace))
    return kinds


OUTCOME = {"success": bool, "message": str}
BOX = {"min": Point, "max": Point}
HIT = {**OUTCOME, "hit": bool, "center": Point, "distance": float64, "probability": float64}
# Name, type, and the fields of request and response.
SERVICE_TYPES = {
    "save": ("std_srvs", "Trigger", {}, OUTCOME),
    "reset": ("std_srvs", "Empty", {}, {}),
    "clear_bbox": ("octomap_msgs", "BoundingBoxQuery", BOX, {}),
    "octomap_binary": ("octomap_msgs", "GetOctomap", {}, {"map": Octomap}),
    "octomap_full": ("octomap_msgs", "GetOctomap", {}, {"map": Octomap}),
    "octomap_in_box": ("voxtile_msgs", "GetOctomapInBox", {**BOX, "binary": bool}, {**OUTCOME, "map": Octomap}),
    "snapshot": ("voxtile_msgs", "Snapshot", {"name": str}, OUTCOME),
    "revert": ("voxtile_msgs", "Snapshot", {"name": str}, OUTCOME),
    "cast_ray": (
        "voxtile_msgs",
        "CastRay",
        {"origin": Point, "direction": Vector3, "max_range": float64, "unknown_is_obstacle": bool},
        HIT,
    ),
    "check_collision": (
        "voxtile_msgs",
        "CheckCollision",
        {"from_": Point, "to": Point, "radius": float64, "unknown_is_obstacle": bool},
        HIT,
    ),
    "get_esdf_and_gradient": (
        "nvblox_msgs",
        "EsdfAndGradients",
        {
            "update_esdf": bool,
            "visualize_esdf": bool,
            "use_aabb": bool,
            "frame_id": str,
            "aabb_min_m": Point,
            "aabb_size_m": Vector3,
            "aabbs_to_clear_min_m": sequence[Point],
            "aabbs_to_clear_size_m": sequence[Vector3],
            "spheres_to_clear_center_m": sequence[Point],
            "spheres_to_clear_radius_m": sequence[float32],
        },
        {
            "header": Header,
            "origin_m": Point,
            "voxel_size_m": float32,
            "esdf_and_gradients": Float32MultiArray,
            "success": bool,
        },
    ),
}
SERVICES = {name: service(*kind, MARKS) for name, kind in SERVICE_TYPES.items()}
# Names of services that are not below the node's name.
OPEN = ["octomap_binary", "octomap_full"]
