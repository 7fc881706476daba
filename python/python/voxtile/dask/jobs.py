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
from .pieces import attempt_in
from .regions import Column
from .simulation import advised_region_size
from .tiles import Tile, map_tiles

if TYPE_CHECKING:
    from numpy.typing import NDArray
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
    path, snapshot = _map_at(os.fspath(map))
    told = describe(path if snapshot is None else (path, snapshot))
    size = advised_region_size(told["max_range"], told["tile_size"]) if region_size is None else region_size
    if not size >= 2 * told["tile_size"]:
        raise ArgumentError(f"region_size: {size} m is less than two tiles of {told['tile_size']} m; take more")
    with Map.open(path, "r", snapshot=snapshot) as opened:
        heights = (float(opened.tiles[:, 2].min(initial=0)), float(opened.tiles[:, 2].max(initial=0)) + 1.0)
        columns = _columns(opened.tiles[:, :2], told["tile_size"], size)
    low, high = (height * told["tile_size"] for height in heights)
    found: Any = _dask.Client.current() if client is None else client
    with attempt_in(output.with_name(f"{output.name}.unfinished")) as folder:
        futures = [
            found.submit(
                _export_region,
                os.path.abspath(map),
                str(folder),
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
        for attempt in folder.glob("attempt-*"):
            attempt.unlink()
        os.rename(folder, output)
    return {"output": str(output), "region_size": size, "files": sorted(task["file"] for task in tasks)}


def _map_at(text: str) -> tuple[str, str | None]:
    """A map and the name of a snapshot, as the command reads ``MAP@SNAPSHOT``: not where that is a file's name."""
    map, at, name = text.rpartition("@")
    if not at or os.sep in name or os.path.lexists(text):
        return text, None
    return map, name


def _columns(tiles: NDArray[np.int32], tile_size: float, size: float) -> list[Column]:
    """The regions that have a part of a tile: of one that a border cuts two, of one with a corner inside four."""
    # Regions are no smaller than tiles. A tile that ends where a region begins has nothing in it.
    low, high = (np.floor((tiles + end) * tile_size / size - shift) for end, shift in ((0, -1e-9), (1, 1e-9)))
    corners = (np.stack([x[:, 0], y[:, 1]], axis=1) for x in (low, high) for y in (low, high))
    return sorted({(int(x), int(y)) for corner in corners for x, y in corner})


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
