"""Work on a finished map, region by region.

A task reads its own tiles only. It writes beside the output under a name of its own attempt, and then renames that: a
lost task is run again, and no file is there in part.
"""

from __future__ import annotations

import os
import uuid
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import distributed
import numpy as np

from .. import files
from .._voxtile import Map, describe
from ..errors import ArgumentError
from ..files import ExportOptions
from . import losses
from .simulation import advised_region_size
from .tiles import Tile, map_tiles

if TYPE_CHECKING:
    from typing_extensions import Unpack

_Path = str | os.PathLike[str]

# Its types are not complete.
_dask: Any = distributed


def export(
    map: _Path,
    out: _Path,
    suffix: str,
    *,
    region_size: float | None = None,
    client: distributed.Client | None = None,
    **options: Unpack[ExportOptions],
) -> dict[str, Any]:
    """Writes a file for each region of a map into the new folder ``out``, in the format of the ending ``suffix``.

    ``x_y`` and the suffix name a file; it has what ``voxtile.export`` writes of that region, byte for byte. Regions
    without a tile get no file. ``suffix`` is one of a single file (``.ply``, ``.las``, ``.csv`` and so on);
    ``options`` are those of ``voxtile.export`` but for ``region``. The map is not to be changed meanwhile: name a
    snapshot, ``"map@snapshot"``, while somebody writes to it.
    """
    if "region" in options:
        raise ArgumentError("region: regions are those of the tasks; leave it out, or use voxtile.export")
    if not suffix.startswith(".") or os.sep in suffix:
        raise ArgumentError(f"suffix: {suffix!r} is no ending of a file, such as .ply")
    output = Path(os.path.abspath(out))
    if output.exists():
        raise ArgumentError(f"{output}: it exists; name a new folder, or remove it")
    path, _, snapshot = os.fspath(map).partition("@")
    source = os.path.abspath(path) + (f"@{snapshot}" if snapshot else "")
    told = describe((path, snapshot) if snapshot else path)
    size = advised_region_size(told["max_range"], told["tile_size"]) if region_size is None else region_size
    if not size >= 2 * told["tile_size"]:
        raise ArgumentError(f"region_size: {size} m is less than two tiles of {told['tile_size']} m; take more")
    with Map.open(path, "r", snapshot=snapshot or None) as opened:
        heights = (float(opened.tiles[:, 2].min(initial=0)), float(opened.tiles[:, 2].max(initial=0)) + 1.0)
        # A region that cuts a tile gets a part of it, and so does the next one.
        corners = [np.floor((opened.tiles[:, :2] + end) * told["tile_size"] / size - shift) for end, shift in _ENDS]
    low, high = (height * told["tile_size"] for height in heights)
    columns = sorted({(int(x), int(y)) for corner in corners for x, y in corner})
    found: Any = _dask.Client.current() if client is None else client
    beside = output.with_name(f"{output.name}.unfinished")
    beside.mkdir(parents=True, exist_ok=True)
    futures = [
        found.submit(
            _export_region,
            source,
            str(beside),
            f"{x}_{y}{suffix}",
            [x * size, y * size, low, (x + 1) * size, (y + 1) * size, high],
            dict(options),
            pure=False,
            retries=2,
        )
        for x, y in columns
    ]
    try:
        with losses.told(use_less="take a smaller region_size", then="call again"):
            tasks: list[dict[str, Any]] = found.gather(futures)
    finally:
        found.cancel(futures)
    for attempt in beside.glob("attempt-*"):
        attempt.unlink()
    os.rename(beside, output)
    return {"output": str(output), "region_size": size, "files": sorted(task["file"] for task in tasks)}


# The low and the high corner of a tile; one that ends where a region begins has nothing in it.
_ENDS = ((0, 0.0), (1, 1e-9))


def _export_region(
    map: str, folder: str, name: str, region: list[float], options: Mapping[str, Any]
) -> dict[str, Any]:
    attempt = os.path.join(folder, f"attempt-{uuid.uuid4().hex}-{name}")
    how: Any = {**options, "region": region}
    files.export(map, attempt, **how)
    os.replace(attempt, os.path.join(folder, name))
    return {"file": name}


def statistics(
    map: _Path, *, snapshot: str | None = None, client: distributed.Client | None = None
) -> dict[str, Any]:
    """Counts a map's tiles, its observed, occupied and free voxels, and the bounds of what is occupied in metres."""
    found: Any = _dask.Client.current() if client is None else client
    with losses.told(use_less="take workers with fewer threads", then="call again"):
        counted = found.compute(map_tiles(map, _count, snapshot=snapshot)).result()
    occupied = [tile for tile in counted if tile["occupied"]]
    return {
        "tiles": len(counted),
        **{name: sum(tile[name] for tile in counted) for name in ("observed", "occupied", "free")},
        "occupied_low": np.min([tile["low"] for tile in occupied], axis=0).tolist() if occupied else None,
        "occupied_high": np.max([tile["high"] for tile in occupied], axis=0).tolist() if occupied else None,
    }


def _count(tile: Tile) -> dict[str, Any]:
    log_odds, _ = tile.dense("log_odds")
    centers, _ = tile.occupied()
    observed = int(np.isfinite(log_odds).sum())
    told = {"observed": observed, "occupied": len(centers), "free": observed - len(centers)}
    if len(centers) > 0:
        told.update(low=centers.min(axis=0), high=centers.max(axis=0))
    return told
