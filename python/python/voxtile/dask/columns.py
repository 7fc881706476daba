"""Whole maps made or checked column by column of their tiles.

What a task makes it makes on its worker's disk, and puts it beside the others under a name of its own attempt; the
process that was called joins the columns, which have no tile in common.
"""

from __future__ import annotations

import math
import os
import tempfile
import uuid
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, Literal

from .. import _voxtile
from .._voxtile import Map
from ..errors import ArgumentError, VoxtileError
from . import losses
from .pieces import attempt_in, hand_over
from .regions import Column, column_of, tiles_of

try:
    import distributed
except ImportError:
    raise ImportError("voxtile.dask needs distributed: pip install voxtile[dask]") from None

_Path = str | os.PathLike[str]
_Index = tuple[int, int, int]
_Progress = Callable[[int, int], object] | None

# Its types are not complete.
_dask: Any = distributed

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
        tiles, tile_size = _tiles([source])
    except VoxtileError:
        # Without its list of tiles a map cannot be divided.
        return _voxtile.verify(source, progress=progress)
    columns, _ = _divided(tiles, tile_size, region_size)
    tasks = [(_verify_tiles, (source, None)), *((_verify_tiles, (source, some)) for some in columns.values())]
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


def _tiles(maps: Sequence[str]) -> tuple[set[_Index], float]:
    """The tiles of all maps, and the edge of one."""
    tiles: set[_Index] = set()
    tile_size = 0.0
    for map in maps:
        with Map.open(map, "r") as opened:
            tiles.update((int(x), int(y), int(z)) for x, y, z in opened.tiles)
            tile_size = tile_size or opened.tile_size
    return tiles, tile_size


def _divided(
    tiles: set[_Index], tile_size: float, region_size: float | None
) -> tuple[dict[Column, list[_Index]], float]:
    """Tiles by the column that they are in, and the edge of a column."""
    size = _TILES_OF_COLUMN * tile_size if region_size is None else region_size
    if not (math.isfinite(size) and size >= 2 * tile_size):
        raise ArgumentError(f"region_size: {size} m is less than two tiles of {tile_size} m; take more")
    columns: dict[Column, list[_Index]] = {}
    for tile in sorted(tiles):
        columns.setdefault(column_of(tile[:2], size, tile_size), []).append(tile)
    return columns, size


def _run(client: Any, tasks: Sequence[tuple[Callable[..., Any], tuple[Any, ...]]], progress: _Progress) -> list[Any]:
    """The answers of tasks in their order."""
    found = _dask.Client.current() if client is None else client
    futures = [found.submit(function, *given, pure=False, retries=2) for function, given in tasks]
    try:
        for done, future in enumerate(_dask.as_completed(futures), 1):
            with _losses_told():
                future.result()
            # What this raises is its caller's.
            if progress is not None:
                progress(done, len(futures))
        with _losses_told():
            answers: list[Any] = found.gather(futures)
        return answers
    finally:
        found.cancel(futures)


def _losses_told() -> AbstractContextManager[None]:
    return losses.told(use_less="take a smaller region_size", then="call again")


def _make(
    maps: Sequence[str], output: Path, work: _Work, region_size: float | None, client: Any, progress: _Progress
) -> dict[str, Any]:
    """A new map of what is made of each column."""
    tiles, tile_size = _tiles(maps)
    columns, size = _divided(tiles, tile_size, region_size)
    # A map without tiles has parameters all the same.
    columns = columns or {(0, 0): []}
    # Not the name that parts of a build have, which are kept if it fails.
    with attempt_in(output.with_name(output.name + ".columns")) as pieces:
        map_id = pieces.name
        tasks = [
            (_make_part, (list(maps), str(pieces / f"{x}_{y}"), map_id, tiles_of((x, y), size, tile_size), work))
            for x, y in columns
        ]
        merged = _voxtile.join(_run(client, tasks, progress), str(output))
    return {"output": str(output), "regions": len(columns), "tiles": merged.get("tiles")}


def _make_part(maps: Sequence[str], place: str, map_id: str, box: Sequence[float], work: _Work) -> str:
    operation, given = work
    with _local_folder() as local:
        crops = [os.path.join(local, str(number)) for number in range(len(maps))]
        for map, crop in zip(maps, crops, strict=True):
            # Of several, what is made of them gets the id.
            _voxtile.crop(map, crop, box, piece_of=map_id if len(maps) == 1 else uuid.uuid4().hex)
        made = crops[0]
        if operation == "merge" and len(maps) > 1:
            made = os.path.join(local, "merged")
            # Those without a tile here, too: what the map is like is told by the first, and all are to go with it.
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
