"""One map by many workers of a dask cluster, and functions over its tiles: ``pip install voxtile[dask]``.

``python -m voxtile.dask`` is the command.
"""

from .building import BuildOptions, build
from .tiles import Tile, map_tiles

__all__ = ["BuildOptions", "Tile", "build", "map_tiles"]
