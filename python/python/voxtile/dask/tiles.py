"""User functions over the tiles of a map."""

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

# The type hints of `dask.bag` are incomplete.
_bag: Any = dask.bag

# Tiles per task: opening a map takes as long as reading a few.
_TILES_AT_ONCE = 16


class _Opened(threading.local):
    """The map of the current task, by process, path and snapshot. Threads of a worker run different tasks."""

    def __init__(self) -> None:
        self.maps: dict[tuple[int, str, str | None], Map] = {}


_opened = _Opened()


@dataclass(frozen=True)
class Tile:
    """A tile of a map. Its arrays are read on access."""

    map: str
    snapshot: str | None
    index: _Index

    @property
    def region(self) -> list[float]:
        """Box of the tile: low x, y, z and high x, y, z in metres."""
        size = self._reader().tile_size
        return [size * number for number in self.index] + [size * (number + 1) for number in self.index]

    def occupied(self, min_probability: float | None = None) -> tuple[NDArray[np.float64], NDArray[np.float32]]:
        """Centers (n, 3) in metres and probabilities (n) of the tile's occupied voxels."""
        return self._reader().occupied(self.region, min_probability)

    def dense(
        self, values: Literal["occupancy", "probability", "log_odds"] = "occupancy"
    ) -> tuple[NDArray[Any], NDArray[np.float64]]:
        """All voxels of the tile as an array by x, y, z, and the lower corner of the first, as in ``Map.to_dense``."""
        return self._reader().to_dense(self.region, values)

    def _reader(self) -> Map:
        # A forked process must open its own map.
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
    """Applies ``function`` to each tile of a map, or to ``tiles``: a lazy ``dask.bag.Bag`` of results in their
    order.

    ``compute()`` runs it on the current client; ``sum()``, ``fold()`` and the like combine results on the workers.
    All workers must see ``map`` under the same path. Each task reads the last flush before it began: pass a
    ``snapshot`` if the map is being written.
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
    # A map opened by an earlier task may be at an earlier flush.
    _opened.maps.clear()
    return [function(tile) for tile in tiles]
