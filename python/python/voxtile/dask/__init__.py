"""Builds and other operations on one map, distributed over a dask cluster: ``pip install voxtile[dask]``.

``python -m voxtile.dask`` is the command; ``python -m voxtile.dask.plan`` estimates the cost of mapping a city.
"""

from .building import BuildOptions, build
from .cleaning import clean
from .columns import decay, merge, verify
from .comparing import CompareOptions, compare
from .jobs import export, statistics
from .remapping import remap, remove_points, remove_scans
from .tiles import Tile, map_tiles

__all__ = [
    "BuildOptions",
    "CompareOptions",
    "Tile",
    "build",
    "clean",
    "compare",
    "decay",
    "export",
    "map_tiles",
    "merge",
    "remap",
    "remove_points",
    "remove_scans",
    "statistics",
    "verify",
]
