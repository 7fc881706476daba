"""Scans from files and exports to other programs: the commands ``build`` and ``export`` in this process."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Literal, TypedDict

from ._voxtile import ScanIterator, call_build, call_export, call_export_scans, open_scans, scan_reaches
from ._voxtile import count_scans as _count_scans

if TYPE_CHECKING:
    from typing_extensions import Unpack

_Path = str | os.PathLike[str]
_Paths = _Path | Sequence[_Path]
_Corners = Sequence[float] | Sequence[Sequence[float]]


class ReadOptions(TypedDict, total=False):
    """Options for reading scans. Lengths are in metres, times in seconds; defaults are those of ``voxtile build``.

    ``format`` is needed if the content does not identify it: pcd ply xyz bin las laz copc e57 tum-rgbd depth bag
    mcap db3 rosbag2 graph log scans. ``topic``, ``odometry`` and ``fixed_frame`` select data of a recording;
    ``first``, ``count`` and ``every`` select scans. ``poses`` is a file of poses (TUM, KITTI, CSV, .npy), sensor to
    world, or "identity". ``extrinsic`` is the pose of the sensor in the body frame of the poses: seven numbers, or
    twelve of a 3 x 4 matrix.
    """

    format: str | None
    topic: str | None
    odometry: str | None
    fixed_frame: str | None
    fields: str | Sequence[str] | None
    first: int
    count: int | None
    every: int
    poses: _Path | None
    calib: _Path | None
    pose_tolerance: float
    extrinsic: Sequence[float] | Sequence[Sequence[float]] | None
    world_frame: bool
    deskew: bool
    ignore_box: _Corners | None
    ignore_frame: Literal["sensor", "body"]
    round_points: float | None
    only_class: Sequence[int]
    skip_class: Sequence[int]
    returns: Literal["all", "first", "last"]
    scan_period: float
    sensor_origin: Sequence[float] | None
    depth_scale: float | None
    intrinsics: _Path | None


class BuildOptions(ReadOptions, total=False):
    """Options of a build: those of ``ReadOptions``, and the options of ``voxtile build``.

    Lengths are in metres. Defaults are those of the command, or the parameters of the map that is resumed.
    """

    resolution: float
    tile_size: float
    storage: Literal["octomap", "compact"]
    memory: int | str
    min_range: float
    max_range: float | None
    sensor_model: Literal["log-odds", "iwlo"]
    probabilities: Sequence[float] | None
    occupancy_threshold: float
    intensity_threshold: float
    intensity_max: float
    insert_mode: Literal["per-scan", "per-ray"]
    clearing: Literal["octomap", "guarded"]
    layers: str
    keep_scans: bool
    region: _Corners | None
    clear_no_return: float | None
    no_rays: bool
    append: bool
    resume: bool
    again: bool
    skip_bad: bool
    strict: bool
    flush_every: int | str
    when_behind: Literal["wait", "drop-oldest", "thin"]


class ExportOptions(TypedDict, total=False):
    """Options of ``voxtile export``. Lengths are in metres, whatever the ``unit`` of the file.

    ``format`` is needed if the extension of the output does not name it: ply pcd csv bt ot xyz npz las laz copc e57
    parquet mcap glb nav2 heightmap geotiff autoware 3dtiles.
    """

    format: str | None
    min_probability: float | None
    what: Literal["occupied", "free", "all"] | None
    no_layers: bool
    mean_points: bool
    only_class: Sequence[int]
    z_min: float | None
    z_max: float | None
    cell: float | None
    quantize: bool
    region: _Corners | None
    origin: Sequence[float] | None
    crs: str | None
    unit: Literal["m", "ft", "us-ft"] | None
    memory: int | str


def scans(path: _Paths, **options: Unpack[ReadOptions]) -> ScanIterator:
    """Iterates over the scans of a file or folder, in any format of the command, or over those that a map keeps.

    With a list of paths, the scans of all of them follow each other.

    A scan is a tuple of points in the sensor's frame (``float64``, N x 3), the pose (4 x 4) and intensities
    (``float32``, or ``None``). ``ReadOptions`` lists the keywords. After each scan, ``moving`` of the iterator has the
    marks of its points (see ``voxtile.clean``): ``bool``, or ``None`` if no point is marked.
    """
    return open_scans(path, options)


def count_scans(path: _Paths, **options: Unpack[ReadOptions]) -> int:
    """Counts the scans of a file or folder. Reads the whole input if it stores no number of scans; ``.scans`` files are
    counted without decoding the scans.
    """
    return _count_scans(path, options)


def reaches(
    path: _Paths,
    *,
    max_range: float | None = None,
    clear_no_return: float | None = None,
    **options: Unpack[ReadOptions],
) -> list[tuple[str, tuple[float, float, float, float] | None]]:
    """Returns for each scan a fingerprint, and a box (west, south, east, north) around it and its rays in metres.

    The box is ``None`` if the scan changes no voxel.
    """
    return scan_reaches(path, options, max_range=max_range, no_return_range=clear_no_return)


def build_shard(
    path: _Path, output: _Path, map_id: str, scans_before: int = 0, **options: Unpack[BuildOptions]
) -> dict[str, Any]:
    """Builds a shard of the map with this id, as ``build`` does. It is durable after ``move_shard``. For an update,
    ``scans_before`` is the number of scans of the map.
    """
    return call_build(path, output, options, shard_of=map_id, scans_before=scans_before)


def build(
    path: _Paths,
    output: _Path,
    *,
    progress: Callable[[int, int], object] | None = None,
    **options: Unpack[BuildOptions],
) -> dict[str, Any]:
    """Makes a map of a file or folder of scans, or of a list of them in this order, or adds them to one, as
    ``voxtile build`` does.

    ``BuildOptions`` lists the keywords. ``progress`` is called with two numbers: the scans done and all scans, 0 if
    their number is unknown. Returns what the command prints with ``--json``; its remarks are warnings, too. If it is
    interrupted, the map contains the scans accepted until then, and ``resume=True`` continues the build.
    """
    answer = call_build(path, output, options, progress)
    for remark in answer["remarks"]:
        warnings.warn(remark, stacklevel=2)
    return answer


def export(
    path: _Path,
    output: _Path,
    *,
    progress: Callable[[int, int], object] | None = None,
    **options: Unpack[ExportOptions],
) -> dict[str, Any]:
    """Exports a map to a file of another program. The extension selects the format, as in ``voxtile export``.

    ``path`` is a map, a file of OctoMap, or ``"map@snapshot"``. Only flushed scans are exported. ``ExportOptions``
    lists the keywords. Returns the report that the command prints with ``--json``. If it is interrupted, no output
    is written.
    """
    return call_export(path, output, options, progress)


def export_scans(
    path: _Path,
    output: _Path,
    *,
    only_moving: bool = False,
    progress: Callable[[int, int], object] | None = None,
) -> dict[str, Any]:
    """Exports the scans that a map keeps into a new folder: a ``.pcd`` file each, and ``poses_tum.txt``.

    If ``voxtile.clean`` has marked points, the files have a field ``moving`` (0 or 1). With ``only_moving``, they have
    only these points.
    """
    return call_export_scans(path, output, only_moving, progress)
