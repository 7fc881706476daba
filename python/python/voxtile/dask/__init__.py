"""One map by many workers of a dask cluster, and work on maps tile by tile: ``pip install voxtile[dask]``.

``python -m voxtile.dask`` is the command, and ``python -m voxtile.dask.plan`` tells what it would take.
"""

from .building import BuildOptions, build
from .jobs import decay, export, merge, statistics, verify
from .plan import Plan, advised_region_size, simulate
from .tiles import Tile, map_tiles

__all__ = [
    "BuildOptions",
    "Plan",
    "Tile",
    "advised_region_size",
    "build",
    "decay",
    "export",
    "map_tiles",
    "merge",
    "simulate",
    "statistics",
    "verify",
]
