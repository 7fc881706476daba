"""One map by many workers of a dask cluster: ``pip install voxtile[dask]``.

``python -m voxtile.dask`` is the command.
"""

from .building import BuildOptions, build

__all__ = ["BuildOptions", "build"]
