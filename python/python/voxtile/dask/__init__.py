"""One map by many workers of a dask cluster, and work on maps tile by tile: ``pip install voxtile[dask]``.

``python -m voxtile.dask`` is the command, and ``python -m voxtile.dask.plan`` tells what a city would take.
"""

from .building import BuildOptions, build
from .columns import decay, merge, verify
from .jobs import export, statistics
from .tiles import Tile, map_tiles

__all__ = ["BuildOptions", "Tile", "build", "decay", "export", "map_tiles", "merge", "statistics", "verify"]
