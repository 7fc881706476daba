"""Files of scans in, files for other programs out: what the commands ``build`` and ``export`` do, in this process."""

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
_Corners = Sequence[float] | Sequence[Sequence[float]]


class ReadOptions(TypedDict, total=False):
    """How scans are read. Lengths are in metres, times in seconds; what is left out is as for ``voxtile build``.

    ``format`` names what the content does not tell: pcd ply xyz bin las laz copc e57 tum-rgbd depth bag mcap db3
    rosbag2 graph log scans. ``topic``, ``odometry`` and ``fixed_frame`` choose from a recording, ``first``, ``count``
    and ``every`` choose scans. ``poses`` is a file of poses (TUM, KITTI, CSV, .npy), sensor to world, or "identity";
    ``extrinsic`` says where the sensor is in the body that poses are of: seven numbers, or twelve of a 3 x 4 matrix.
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
    scan_period: float
    sensor_origin: Sequence[float] | None
    depth_scale: float | None
    intrinsics: _Path | None


class BuildOptions(ReadOptions, total=False):
    """How a map is built: all that ``ReadOptions`` says of reading, and the options of ``voxtile build``.

    Lengths are in metres; what is left out is the command's default, or as the map is that goes on.
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
    """What is written, and how: the options of ``voxtile export``. Lengths are in metres.

    ``format`` names what the ending of the output does not: ply pcd csv bt ot xyz npz las laz copc e57 parquet mcap
    glb nav2 heightmap autoware 3dtiles.
    """

    format: str | None
    min_probability: float | None
    what: Literal["occupied", "free", "all"] | None
    z_min: float | None
    z_max: float | None
    cell: float | None
    quantize: bool
    region: _Corners | None
    origin: Sequence[float] | None
    memory: int | str


def scans(path: _Path, **options: Unpack[ReadOptions]) -> ScanIterator:
    """Iterates over the scans of a file or folder of any format that the command reads, or over those that a map keeps.

    A scan is a tuple of points in the sensor's frame (``float64``, N x 3), the pose (4 x 4) and intensities
    (``float32``, or ``None``). ``ReadOptions`` lists the keywords.
    """
    return open_scans(path, options)


def count_scans(path: _Path, **options: Unpack[ReadOptions]) -> int:
    """The number of scans of a file or folder. Where the format does not tell it, they are read, but in ``.scans``."""
    return _count_scans(path, options)


def reaches(
    path: _Path,
    *,
    max_range: float | None = None,
    clear_no_return: float | None = None,
    **options: Unpack[ReadOptions],
) -> list[tuple[str, tuple[float, float, float, float] | None]]:
    """Of each scan what tells it from others, and a box (west, south, east, north) around it and its rays in metres.

    The box is ``None`` where a scan leaves nothing in a map.
    """
    return scan_reaches(path, options, max_range=max_range, no_return_range=clear_no_return)


def build_piece(path: _Path, output: _Path, map_id: str, **options: Unpack[BuildOptions]) -> dict[str, Any]:
    """Makes a map as ``build`` does, but as a piece of the map with this id: ``move_piece`` makes it durable."""
    return call_build(path, output, options, piece_of=map_id)


def build(
    path: _Path,
    output: _Path,
    *,
    progress: Callable[[int, int], object] | None = None,
    **options: Unpack[BuildOptions],
) -> dict[str, Any]:
    """Makes a map of a file or folder of scans, or adds them to one, as ``voxtile build`` does.

    ``BuildOptions`` lists the keywords. ``progress`` is called with the scans done and their number, 0 if that is not
    known. Returns what the command prints with ``--json``; its remarks are warnings, too. If it is interrupted, the map
    has what was accepted until then, and ``resume=True`` goes on.
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
    """Writes a map for other programs; the name's ending says in which format, as for ``voxtile export``.

    ``path`` is a map, a file of OctoMap, or ``"map@snapshot"``; what is not flushed is not exported. ``ExportOptions``
    lists the keywords. Returns what the command prints with ``--json``. If it is interrupted, nothing is written.
    """
    return call_export(path, output, options, progress)


def export_scans(
    path: _Path, output: _Path, *, progress: Callable[[int, int], object] | None = None
) -> dict[str, Any]:
    """Writes the scans that a map keeps into a new folder: a ``.pcd`` each, and ``poses_tum.txt``."""
    return call_export_scans(path, output, progress)
