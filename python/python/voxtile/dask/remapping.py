"""New poses for a map by many workers: each replays the affected tiles of some columns, and one commit changes the map."""

from __future__ import annotations

import hashlib
import json
import os
import re
import tempfile
from collections.abc import Callable, Iterable, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import distributed

from .._voxtile import describe, join_remap, remap_columns, remap_part, verify
from ..errors import ArgumentError, VoxtileError
from . import losses
from .shards import locked, move_to_place, remove
from .simulation import advised_region_size

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    _Pose = ArrayLike | tuple[ArrayLike, ArrayLike]

_Path = str | os.PathLike[str]

# The type hints of `distributed` are incomplete.
_dask: Any = distributed

# Names of the files that calls leave in the folder of parts: shards, and their texts.
_OWN_NAMES = re.compile(r"attempt-[0-9a-f]{32}(\.unfinished)?|[0-9a-f]{16}-(-?[0-9]+)-(-?[0-9]+)(\.(json|new))?")


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
    progress: Callable[[int, int], object] | None = None,
) -> dict[str, Any]:
    """Assigns new poses to the scans that a map keeps, as ``voxtile.remap`` does, with the workers of ``client``, or of
    the current client.

    The map has the digests of ``voxtile.remap``, for any ``region_size`` (metres, along x and y). Only tiles that moved
    scans touch are replayed. One commit changes the map, so readers see it before or after. Finished parts are kept in
    ``map + ".remap.parts"`` until then: the same call resumes after a failure. If another process changes the map
    meanwhile, the call raises an error. ``memory`` is per task; ``progress`` is called with the number of finished parts
    and their total. Returns the report of ``voxtile.remap``, and the number of parts.
    """
    path = Path(os.path.abspath(map))
    described = describe(str(path))
    tile_size: float = described["tile_size"]
    size = advised_region_size(described["max_range"], tile_size) if region_size is None else region_size
    tiles = round(size / tile_size)
    if tiles < 1:
        raise ArgumentError(f"region_size: {size} m is less than a tile of {tile_size} m; use more")
    how: dict[str, Any] = {"interpolate": interpolate, "tolerance": tolerance}
    found: Any = _dask.Client.current() if client is None else client
    parts = path.with_name(f"{path.name}.remap.parts")
    if not isinstance(poses, Mapping):
        poses = list(poses)
    with locked(parts, _OWN_NAMES):
        columns = remap_columns(str(path), poses, tiles, **how)
        state = (described["map_id"], described["flush_number"], tiles, _digest(poses), interpolate, tolerance)
        mark = hashlib.sha256(json.dumps([version("voxtile"), *state]).encode()).hexdigest()[:16]
        names = [parts / f"{mark}-{x}-{y}" for x, y in columns]
        unfinished = [number for number, name in enumerate(names) if _read(name) is None]
        sent: Any = found.scatter([poses], broadcast=True)[0] if unfinished else None
        futures = [
            found.submit(
                _remap_part,
                str(path),
                sent,
                columns[number],
                tiles,
                str(names[number]),
                described["map_id"],
                {**how, "memory": memory},
                pure=False,
                retries=2,
            )
            for number in unfinished
        ]
        checks = [
            found.submit(_check_shard, str(name), pure=False, retries=2)
            for number, name in enumerate(names)
            if number not in set(unfinished) and name.exists()
        ]
        try:
            with losses.explained(use_less="use a smaller region_size or memory", then="call again to resume"):
                done = len(names) - len(unfinished)
                for future in _dask.as_completed(futures):
                    future.result()
                    done += 1
                    if progress is not None:
                        progress(done, len(names))
                found.gather(checks)
        finally:
            found.cancel([*futures, *checks])
        texts = [(str(name) if name.exists() else None, _read(name) or "") for name in names]
        report = join_remap(str(path), poses, texts, keep_as=keep_as, memory=memory, **how)
        remove(parts)
    return {**report, "parts": len(names), "parts_done_before": len(names) - len(unfinished)}


def _digest(poses: Any) -> str:
    import numpy as np

    digest = hashlib.sha256()
    listed = poses.items() if isinstance(poses, Mapping) else enumerate(poses)
    for number, pose in listed:
        digest.update(f"{number} ".encode())
        digest.update(np.asarray(pose, np.float64).tobytes())
    return digest.hexdigest()


def _read(name: Path) -> str | None:
    """Returns the text of a finished part."""
    try:
        text = name.with_name(f"{name.name}.json").read_text(encoding="utf-8")
        json.loads(text)
    except (FileNotFoundError, ValueError):
        return None
    return text


def _remap_part(
    map: str, poses: Any, column: tuple[int, int], tiles: int, name: str, map_id: str, how: dict[str, Any]
) -> None:
    with tempfile.TemporaryDirectory(prefix="voxtile-", dir=_dask.get_worker().local_directory) as local:
        made = os.path.join(local, "map")
        text = remap_part(map, poses, column, tiles, made, **how)
        if os.path.exists(made):
            move_to_place(made, name, map_id)
    # The text makes the part complete, so it comes last.
    unfinished = f"{name}.new"
    with open(unfinished, "w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    os.replace(unfinished, f"{name}.json")


def _check_shard(name: str) -> None:
    """Verifies a shard of an earlier call, which may have been damaged since."""
    for finding in verify(name)["findings"]:
        if finding["severity"] == "damage":
            raise VoxtileError(f"{finding['path']}: {finding['reason']}; remove {name} and {name}.json, and call again")
