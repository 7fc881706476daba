"""A function of one's own over the tiles of a map."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeVar

import numpy as np

from .._voxtile import Map

try:
    import dask.bag
except ImportError:
    raise ImportError("voxtile.dask needs dask: pip install voxtile[dask]") from None

if TYPE_CHECKING:
    from numpy.typing import NDArray

_Path = str | os.PathLike[str]
_Index = tuple[int, int, int]
_T = TypeVar("_T")

# Its types are not complete.
_bag: Any = dask.bag

# Tiles of a task: opening a map takes as long as reading a few.
_TILES_AT_ONCE = 16


class _Opened(threading.local):
    """The map of the task at hand, by process, path and snapshot; threads of a worker have tasks of their own."""

    def __init__(self) -> None:
        self.maps: dict[tuple[int, str, str | None], Map] = {}


_opened = _Opened()


@dataclass(frozen=True)
class Tile:
    """A tile of a map, whose arrays are read when they are asked for."""

    map: str
    snapshot: str | None
    index: _Index

    @property
    def region(self) -> list[float]:
        """The tile's box: low x, y, z and high x, y, z in metres."""
        size = self._reader().tile_size
        return [size * number for number in self.index] + [size * (number + 1) for number in self.index]

    def occupied(self, min_probability: float | None = None) -> tuple[NDArray[np.float64], NDArray[np.float32]]:
        """Centers (n, 3) in metres and probabilities (n) of the tile's occupied voxels."""
        return self._reader().occupied(self.region, min_probability)

    def dense(
        self, values: Literal["occupancy", "probability", "log_odds"] = "occupancy"
    ) -> tuple[NDArray[Any], NDArray[np.float64]]:
        """All voxels of the tile as an array by x, y, z, and the lower corner of the first; as ``Map.to_dense``."""
        return self._reader().to_dense(self.region, values)

    def _reader(self) -> Map:
        # A process that was forked opens its own.
        key = (os.getpid(), self.map, self.snapshot)
        reader = _opened.maps.get(key)
        if reader is None:
            _opened.maps.clear()
            reader = _opened.maps[key] = Map.open(self.map, "r", snapshot=self.snapshot)
        return reader


def map_tiles(
    map: _Path,
    function: Callable[[Tile], _T],
    *,
    tiles: Sequence[_Index] | None = None,
    snapshot: str | None = None,
) -> Any:
    """The results of ``function`` for each tile of a map, or for ``tiles``, as a lazy ``dask.bag.Bag`` in their order.

    ``compute()`` runs it on the current client; ``sum()``, ``fold()`` and the like combine results where they are made.
    All workers need to see ``map`` under the same path. Each task reads the last flush before it began: name a
    ``snapshot`` while somebody writes to the map.
    """
    path = os.path.abspath(map)
    if tiles is None:
        with Map.open(path, "r", snapshot=snapshot) as opened:
            tiles = [(int(x), int(y), int(z)) for x, y, z in opened.tiles]
    named = [Tile(path, snapshot, tile) for tile in tiles]
    if not named:
        return _bag.from_sequence([], npartitions=1)
    return _bag.from_sequence(named, partition_size=_TILES_AT_ONCE).map_partitions(_apply, function)


def _apply(tiles: Sequence[Tile], function: Callable[[Tile], _T]) -> list[_T]:
    # What an earlier task has opened may be an earlier flush.
    _opened.maps.clear()
    return [function(tile) for tile in tiles]
