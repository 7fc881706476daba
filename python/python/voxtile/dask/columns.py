"""Whole maps made or checked column by column of their tiles.

What a task makes it makes on its worker's disk, and puts it beside the others under a name of its own attempt; the
process that was called joins the columns, which have no tile in common.
"""

from __future__ import annotations

import math
import os
import re
import tempfile
import uuid
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal

from .. import _voxtile
from .._voxtile import Map
from ..errors import ArgumentError, VoxtileError
from . import losses
from .pieces import hand_over, locked, remove
from .regions import Column, tiles_of

try:
    import distributed
except ImportError:
    raise ImportError("voxtile.dask needs distributed: pip install voxtile[dask]") from None

_Path = str | os.PathLike[str]
_Index = tuple[int, int, int]
_Progress = Callable[[int, int], object] | None

# Its types are not complete.
_dask: Any = distributed

# The name of an attempt's folder: the id of the map to come.
_ATTEMPT = re.compile("[0-9a-f]{32}")

# Tiles along the edge of a column where nobody names its size.
_TILES_OF_COLUMN = 20


def decay(
    map: _Path,
    out: _Path,
    halflife_scans: float,
    *,
    scans: int | None = None,
    forget_below: float = 0.0,
    region_size: float | None = None,
    client: distributed.Client | None = None,
    progress: _Progress = None,
) -> dict[str, Any]:
    """Makes a map in which evidence has faded as by ``voxtile.decay``; the map it is made of stays as it is."""
    source, output = _places(map, out)
    work: _Work = ("decay", (halflife_scans, scans, forget_below))
    return _make([source], output, work, region_size, client, progress)


def merge(
    maps: Sequence[_Path],
    out: _Path,
    *,
    prefer: Literal["first", "last", "more-observed"] | None = None,
    region_size: float | None = None,
    client: distributed.Client | None = None,
    progress: _Progress = None,
) -> dict[str, Any]:
    """Merges maps of many sessions as ``voxtile.merge`` does, by the same rules.

    Maps that share a past count it twice without ``prefer``; unlike there, nothing warns of it.
    """
    if not maps:
        raise ArgumentError("maps: there are none; name one or more")
    places = [_places(map, out) for map in maps]
    return _make([source for source, _ in places], places[0][1], ("merge", (prefer,)), region_size, client, progress)


def verify(
    map: _Path,
    *,
    region_size: float | None = None,
    client: distributed.Client | None = None,
    progress: _Progress = None,
) -> dict[str, Any]:
    """Checks every file of a map: the sums and ``"findings"`` of ``voxtile.verify``."""
    source = os.path.abspath(map)
    try:
        columns, *_ = _columns([source], region_size)
    except VoxtileError:
        # Without its list of tiles a map cannot be divided.
        return _voxtile.verify(source, progress=progress)
    tasks = [(_verify_tiles, (source, None)), *((_verify_tiles, (source, tiles)) for tiles in columns.values())]
    rest, *parts = _run(client, tasks, progress)
    for part in parts:
        for name in ("tiles", "voxels", "table_bytes"):
            rest[name] += part[name]
        # What is wrong with the lists is found by every task.
        rest["findings"] += [finding for finding in part["findings"] if finding not in rest["findings"]]
    damage = sum(finding["severity"] == "damage" for finding in rest["findings"])
    return {**rest, "damage": damage, "notes": len(rest["findings"]) - damage}


# The operation and what it is told.
_Work = tuple[Literal["decay", "merge"], tuple[Any, ...]]


def _places(map: _Path, out: _Path) -> tuple[str, Path]:
    output = Path(os.path.abspath(out))
    if output.exists():
        raise ArgumentError(f"{output}: it exists; name a new one, or remove it")
    return os.path.abspath(map), output


def _columns(
    maps: Sequence[str], region_size: float | None
) -> tuple[dict[Column, list[_Index]], float, float]:
    """The columns with tiles of any of the maps, the edge of a column and that of a tile."""
    tiles: set[_Index] = set()
    tile_size = 0.0
    for map in maps:
        with Map.open(map, "r") as opened:
            tiles.update((int(x), int(y), int(z)) for x, y, z in opened.tiles)
            tile_size = tile_size or opened.tile_size
    size = _TILES_OF_COLUMN * tile_size if region_size is None else region_size
    if not (math.isfinite(size) and size >= 2 * tile_size):
        raise ArgumentError(f"region_size: {size} m is less than two tiles of {tile_size} m; take more")
    columns: dict[Column, list[_Index]] = {}
    for tile in sorted(tiles):
        column = (math.floor((tile[0] + 0.5) * tile_size / size), math.floor((tile[1] + 0.5) * tile_size / size))
        columns.setdefault(column, []).append(tile)
    return columns, size, tile_size


def _run(client: Any, tasks: Sequence[tuple[Callable[..., Any], tuple[Any, ...]]], progress: _Progress) -> list[Any]:
    """The answers of tasks in their order."""
    found = _dask.Client.current() if client is None else client
    futures = [found.submit(function, *given, pure=False, retries=2) for function, given in tasks]
    try:
        with losses.told(use_less="take a smaller region_size", then="call again"):
            for done, future in enumerate(_dask.as_completed(futures), 1):
                future.result()
                if progress is not None:
                    progress(done, len(futures))
            answers: list[Any] = found.gather(futures)
        return answers
    finally:
        found.cancel(futures)


def _make(
    maps: Sequence[str], output: Path, work: _Work, region_size: float | None, client: Any, progress: _Progress
) -> dict[str, Any]:
    """A new map of what is made of each column."""
    columns, size, tile_size = _columns(maps, region_size)
    if not columns:
        return _voxtile.merge(list(maps), str(output))
    # Not the name that parts of a build have, which are kept if it fails.
    parts = output.with_name(output.name + ".columns")
    with locked(parts):
        # Of a call that was killed there is nothing but the folders of its attempts.
        for name in os.listdir(parts):
            if name != "lock" and not _ATTEMPT.fullmatch(name):
                raise ArgumentError(f"{parts}: {name} in it is of no earlier call; move the folder away")
        try:
            map_id = uuid.uuid4().hex
            # In a folder of this attempt: a task of an earlier one that was given up may still be at work.
            pieces = parts / map_id
            pieces.mkdir()
            places = {column: str(pieces / f"{column[0]}_{column[1]}") for column in columns}
            tasks = [
                (_make_part, (list(maps), place, map_id, tiles_of(column, size, tile_size), work))
                for column, place in places.items()
            ]
            made = [part for part in _run(client, tasks, progress) if part is not None]
            merged = _voxtile.join(made, str(output))
        finally:
            remove(parts)
    return {"output": str(output), "regions": len(columns), "tiles": merged.get("tiles")}


def _make_part(maps: Sequence[str], place: str, map_id: str, box: Sequence[float], work: _Work) -> str | None:
    operation, given = work
    with _local_folder() as local:
        crops = []
        for number, map in enumerate(maps):
            crop = os.path.join(local, str(number))
            # Of several, what is made of them gets the id.
            piece_of = map_id if len(maps) == 1 else uuid.uuid4().hex
            if _voxtile.crop(map, crop, box, piece_of=piece_of).get("tiles", 1):
                crops.append(crop)
        if not crops:
            return None
        made = crops[0]
        if operation == "merge" and len(crops) > 1:
            made = os.path.join(local, "merged")
            _voxtile.merge(crops, made, prefer=given[0])
        elif operation == "decay":
            halflife_scans, scans, forget_below = given
            _voxtile.decay(made, halflife_scans, scans=scans, forget_below=forget_below)
        hand_over(made, place, map_id)
        return place


def _verify_tiles(map: str, tiles: Sequence[_Index] | None) -> dict[str, Any]:
    return _voxtile.verify(map, tiles=tiles, but_tiles=tiles is None)


def _local_folder() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory(prefix="voxtile-", dir=_dask.get_worker().local_directory)
