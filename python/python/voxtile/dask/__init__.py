"""One map by many workers of a dask cluster, and functions work on its tiles: ``pip install voxtile[dask]``.

``python -m voxtile.dask`` is the command.
"""

from .building import BuildOptions, build
from .jobs import export, statistics
from .tiles import Tile, map_tiles

__all__ = ["BuildOptions", "Tile", "build", "export", "map_tiles", "statistics"]
