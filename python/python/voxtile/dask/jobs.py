"""Exports and statistics of a finished map, region by region.

A task reads only its own tiles. It writes to a file of its own attempt, and then renames that to the output: a lost
task can run again, and no partial file appears.
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
from .shards import attempt_in
from .regions import Column
from .simulation import advised_region_size
from .tiles import Tile, map_tiles

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from typing_extensions import Unpack

_Path = str | os.PathLike[str]

# The type hints of `distributed` are incomplete.
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
    """Writes a file for each region of a map into the new folder ``out``, in the format of the extension ``suffix``.

    Files are named ``x_y`` plus the suffix. Each is equal to the output of ``voxtile.export`` for that region.
    Regions without a tile get no file. ``suffix`` must be that of a format with a single file (``.ply``, ``.las``,
    ``.csv`` and so on); ``options`` are those of ``voxtile.export`` except ``region``. The map must not change
    meanwhile: export a snapshot, ``"map@snapshot"``, of a map that is being written.
    """
    if "region" in options:
        raise ArgumentError("region: each task has its own region; leave this option out, or use voxtile.export")
    if not suffix.startswith(".") or os.sep in suffix:
        raise ArgumentError(f"suffix: {suffix!r} is not a file extension, such as .ply")
    output = Path(os.path.abspath(out))
    if output.exists():
        raise ArgumentError(f"{output}: already exists; choose another folder, or remove it")
    path, snapshot = _map_at(os.fspath(map))
    described = describe(path if snapshot is None else (path, snapshot))
    size = advised_region_size(described["max_range"], described["tile_size"]) if region_size is None else region_size
    if not size >= 2 * described["tile_size"]:
        raise ArgumentError(f"region_size: {size} m is less than two tiles of {described['tile_size']} m; use more")
    with Map.open(path, "r", snapshot=snapshot) as opened:
        heights = (float(opened.tiles[:, 2].min(initial=0)), float(opened.tiles[:, 2].max(initial=0)) + 1.0)
        columns = _columns(opened.tiles[:, :2], described["tile_size"], size)
    low, high = (height * described["tile_size"] for height in heights)
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
            with losses.explained(use_less="use a smaller region_size", then="call again"):
                tasks: list[dict[str, Any]] = found.gather(futures)
        finally:
            found.cancel(futures)
        for attempt in folder.glob("attempt-*"):
            attempt.unlink()
        os.rename(folder, output)
    return {"output": str(output), "region_size": size, "files": sorted(task["file"] for task in tasks)}


def _map_at(text: str) -> tuple[str, str | None]:
    """Splits ``MAP@SNAPSHOT`` as the command does: not if a file of that name exists."""
    map, at, name = text.rpartition("@")
    if not at or os.sep in name or os.path.lexists(text):
        return text, None
    return map, name


def _columns(tiles: NDArray[np.int32], tile_size: float, size: float) -> list[Column]:
    """Returns the regions that overlap a tile. A tile on a border is in two regions, one over a corner in four."""
    # Regions are no smaller than tiles. A tile that ends exactly where a region begins does not overlap it.
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
    """Counts a map's tiles and its observed, occupied and free voxels. Also returns the bounds of occupied space in
    metres.
    """
    found: Any = _dask.Client.current() if client is None else client
    with losses.explained(use_less="use workers with fewer threads", then="call again"):
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
    described = {"observed": observed, "occupied": len(centers), "free": observed - len(centers)}
    if len(centers) > 0:
        described.update(low=centers.min(axis=0), high=centers.max(axis=0))
    return described
