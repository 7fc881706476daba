"""Changes of the scans that a map keeps, by many workers: new poses, removal of scans or points."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

import distributed
import numpy as np

from .. import _voxtile
from .replaying import replaying

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    _Pose = ArrayLike | tuple[ArrayLike, ArrayLike]

_Path = str | os.PathLike[str]
_Progress = Callable[[int, int], object]


def remap(
    map: _Path,
    poses: Mapping[int, _Pose] | Iterable[_Pose],
    *,
    interpolate: bool = False,
    tolerance: tuple[float, float] | None = None,
    keep_as: str | None = None,
    region_size: float | None = None,
    memory: int | str | None = None,
    client: distributed.Client | None = None,
    progress: _Progress | None = None,
) -> dict[str, Any]:
    """Assigns new poses to the scans that a map keeps, as ``voxtile.remap`` does, with the workers of ``client``, or of
    the current client.

    The map has the digests of ``voxtile.remap``, for any ``region_size`` (metres, along x and y). Only tiles that moved
    scans touch are replayed. One commit changes the map, so readers see it before or after. Finished parts are kept in
    ``map + ".replay.parts"`` until then: the same call resumes after a failure. If another process changes the map
    meanwhile, the call raises an error. ``memory`` is per task; ``progress`` is called with the number of finished parts
    and their total. Returns the report of ``voxtile.remap``, and the number of parts.
    """
    given = dict(poses) if isinstance(poses, Mapping) else list(poses)
    change = {"kind": "move", "poses": given, "interpolate": interpolate, "tolerance": tolerance}
    key = ["move", _digest(given), interpolate, tolerance]
    with replaying(map, region_size=region_size, memory=memory, client=client, progress=progress) as work:
        return work.join(change, key=key, keep_as=keep_as)


def remove_scans(
    map: _Path,
    *,
    scans: tuple[int, int] | None = None,
    time: tuple[int, int] | None = None,
    input: str | None = None,
    from_snapshots: bool = False,
    keep_as: str | None = None,
    dry_run: bool = False,
    region_size: float | None = None,
    memory: int | str | None = None,
    client: distributed.Client | None = None,
    progress: _Progress | None = None,
) -> dict[str, Any]:
    """Removes scans from a map that keeps them, as ``voxtile.remove_scans`` does, with the workers of ``client``, or of
    the current client. The rules of ``remap`` apply. This process alone makes the estimate of ``dry_run``.
    """
    what: dict[str, Any] = {"scans": scans, "time": time, "input": input}
    how: dict[str, Any] = {"from_snapshots": from_snapshots, "keep_as": keep_as}
    if dry_run:
        return _voxtile.remove_scans(map, **what, **how, dry_run=True, memory=memory, progress=progress)
    with replaying(map, region_size=region_size, memory=memory, client=client, progress=progress) as work:
        return work.join({"kind": "remove_scans", **what}, key=["remove_scans", what], **how)


def remove_points(
    map: _Path,
    region: ArrayLike,
    *,
    keep_as: str | None = None,
    dry_run: bool = False,
    region_size: float | None = None,
    memory: int | str | None = None,
    client: distributed.Client | None = None,
    progress: _Progress | None = None,
) -> dict[str, Any]:
    """Removes all points in a box from the scans that a map keeps, as ``voxtile.remove_points`` does, with the workers
    of ``client``, or of the current client.

    Tasks first search ranges of scans for points in the box; then the rules of ``remap`` apply. ``progress`` counts
    the tasks of both steps. This process alone makes the estimate of ``dry_run``.
    """
    if dry_run:
        return _voxtile.remove_points(map, region, keep_as=keep_as, dry_run=True, memory=memory, progress=progress)
    corners = np.asarray(region, np.float64)
    key = ["remove_points", corners.tolist()]
    with replaying(map, region_size=region_size, memory=memory, client=client, progress=progress) as work:
        _, last, _ = _voxtile.check_replay(work.map, memory=memory)
        # Without scans, one search reports an invalid box.
        searches = [text for _, text in work.search("points", _search_points, max(last, 1), corners, key=key)]
        change = {"kind": "remove_points", "searches": searches}
        return work.join(change, key=key, keep_as=keep_as)


def _search_points(map: str, corners: Any, first: int, last: int, _: str) -> str:
    return _voxtile.search_points(map, corners, first, last)


def _digest(poses: Any) -> str:
    digest = hashlib.sha256()
    listed = poses.items() if isinstance(poses, Mapping) else enumerate(poses)
    for number, pose in listed:
        digest.update(f"{number} ".encode())
        for part in pose if isinstance(pose, tuple) else [pose]:
            digest.update(np.asarray(part, np.float64).tobytes())
    return digest.hexdigest()
