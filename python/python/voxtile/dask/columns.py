"""Operations on whole maps, column by column of their tiles.

Each task writes its column to the worker's disk, and then moves it to its place under a name of its own attempt. The
calling process joins the columns, which are disjoint.
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
from .shards import attempt_in, move_to_place
from .regions import Column, column_of, tiles_of

try:
    import distributed
except ImportError:
    raise ImportError("voxtile.dask needs distributed: pip install voxtile[dask]") from None

_Path = str | os.PathLike[str]
_Index = tuple[int, int, int]
_Progress = Callable[[int, int], object] | None

# The type hints of `distributed` are incomplete.
_dask: Any = distributed

# Default edge of a column in tiles.
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
    """Writes a copy of a map in which evidence has decayed as by ``voxtile.decay``. The source map is unchanged."""
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
    """Merges maps of several sessions as ``voxtile.merge`` does, by the same rules.

    Without ``prefer``, evidence that the maps have in common counts twice. Unlike ``voxtile.merge``, this function
    does not warn of it.
    """
    if not maps:
        raise ArgumentError("maps: the list is empty; pass one or more")
    places = [_places(map, out) for map in maps]
    return _make([source for source, _ in places], places[0][1], ("merge", (prefer,)), region_size, client, progress)


def verify(
    map: _Path,
    *,
    region_size: float | None = None,
    client: distributed.Client | None = None,
    progress: _Progress = None,
) -> dict[str, Any]:
    """Checks every file of a map. Returns the sums and ``"findings"`` of ``voxtile.verify``."""
    source = os.path.abspath(map)
    try:
        tiles, tile_size = _tiles([source])
    except VoxtileError:
        # A map whose list of tiles is unreadable cannot be divided.
        return _voxtile.verify(source, progress=progress)
    columns, _ = _divided(tiles, tile_size, region_size)
    tasks = [(_verify_tiles, (source, None)), *((_verify_tiles, (source, some)) for some in columns.values())]
    rest, *parts = _run(client, tasks, progress)
    for part in parts:
        for name in ("tiles", "voxels", "table_bytes"):
            rest[name] += part[name]
        # Every task also finds problems of the map's lists, so keep only one of equal findings.
        rest["findings"] += [finding for finding in part["findings"] if finding not in rest["findings"]]
    damage = sum(finding["severity"] == "damage" for finding in rest["findings"])
    return {**rest, "damage": damage, "notes": len(rest["findings"]) - damage}


# The operation and its arguments.
_Work = tuple[Literal["decay", "merge"], tuple[Any, ...]]


def _places(map: _Path, out: _Path) -> tuple[str, Path]:
    output = Path(os.path.abspath(out))
    if output.exists():
        raise ArgumentError(f"{output}: already exists; choose another path, or remove it")
    return os.path.abspath(map), output


def _tiles(maps: Sequence[str]) -> tuple[set[_Index], float]:
    """Returns the tiles of all maps, and the edge of a tile."""
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
    """Groups tiles by column. Also returns the edge of a column."""
    size = _TILES_OF_COLUMN * tile_size if region_size is None else region_size
    if not (math.isfinite(size) and size >= 2 * tile_size):
        raise ArgumentError(f"region_size: {size} m is less than two tiles of {tile_size} m; use a larger size")
    columns: dict[Column, list[_Index]] = {}
    for tile in sorted(tiles):
        columns.setdefault(column_of(tile[:2], size, tile_size), []).append(tile)
    return columns, size


def _run(client: Any, tasks: Sequence[tuple[Callable[..., Any], tuple[Any, ...]]], progress: _Progress) -> list[Any]:
    """Runs tasks and returns their results in order."""
    found = _dask.Client.current() if client is None else client
    futures = [found.submit(function, *given, pure=False, retries=2) for function, given in tasks]
    try:
        for done, future in enumerate(_dask.as_completed(futures), 1):
            with _losses_explained():
                future.result()
            # An exception of the callback is not a loss of a worker.
            if progress is not None:
                progress(done, len(futures))
        with _losses_explained():
            answers: list[Any] = found.gather(futures)
        return answers
    finally:
        found.cancel(futures)


def _losses_explained() -> AbstractContextManager[None]:
    return losses.explained(use_less="use a smaller region_size", then="call again")


def _make(
    maps: Sequence[str], output: Path, work: _Work, region_size: float | None, client: Any, progress: _Progress
) -> dict[str, Any]:
    """Joins the results of all columns into a new map."""
    tiles, tile_size = _tiles(maps)
    columns, size = _divided(tiles, tile_size, region_size)
    # A map without tiles still has parameters.
    columns = columns or {(0, 0): []}
    # A build uses another folder name, because it keeps its parts after a failure.
    with attempt_in(output.with_name(output.name + ".columns")) as shards:
        map_id = shards.name
        tasks = [
            (_make_part, (list(maps), str(shards / f"{x}_{y}"), map_id, tiles_of((x, y), size, tile_size), work))
            for x, y in columns
        ]
        merged = _voxtile.join(_run(client, tasks, progress), str(output))
    return {"output": str(output), "regions": len(columns), "tiles": merged.get("tiles")}


def _make_part(maps: Sequence[str], place: str, map_id: str, box: Sequence[float], work: _Work) -> str:
    operation, given = work
    with _local_folder() as local:
        crops = [os.path.join(local, str(number)) for number in range(len(maps))]
        for map, crop in zip(maps, crops, strict=True):
            # With several maps, only their merged result gets the map's id.
            _voxtile.crop(map, crop, box, shard_of=map_id if len(maps) == 1 else uuid.uuid4().hex)
        made = crops[0]
        if operation == "merge" and len(maps) > 1:
            made = os.path.join(local, "merged")
            # Include crops without tiles: the first map determines the parameters, and incompatible maps must be
            # rejected.
            _voxtile.merge(crops, made, prefer=given[0])
        elif operation == "decay":
            halflife_scans, scans, forget_below = given
            _voxtile.decay(made, halflife_scans, scans=scans, forget_below=forget_below)
        move_to_place(made, place, map_id)
        return place


def _verify_tiles(map: str, tiles: Sequence[_Index] | None) -> dict[str, Any]:
    return _voxtile.verify(map, tiles=tiles, but_tiles=tiles is None)


def _local_folder() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory(prefix="voxtile-", dir=_dask.get_worker().local_directory)
