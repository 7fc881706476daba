"""Probabilistic 3D occupancy mapping whose map is bounded by the disk, never by memory.

A ``Map`` takes scans (``insert``) and answers questions about many points, rays and boxes at once; lengths are in
metres, points are arrays of N x 3. Functions of this module work on whole maps on disk, and raise the exceptions of
``voxtile.errors``. Progress callbacks get what is done and how much there is.

Where processes are forked with maps open, threads are missing in the child: start processes with ``spawn``, and open
maps there.
"""

import atexit

from . import errors
from ._voxtile import (
    InsertReport,
    LocalMap,
    Map,
    ScanIterator,
    TileIterator,
    clear,
    convert,
    crop,
    decay,
    delete_snapshot,
    diff,
    import_octree,
    merge,
    remap,
    remap_as,
    remove_points,
    remove_scans,
    repair,
    revert,
    snapshots,
    verify,
    wait_for_all,
)
from .errors import VoxtileError
from .files import build, export, export_scans, scans
from .whole_maps import digest, open, snapshot

# What was interrupted while it could not be given up is finished before the interpreter exits.
atexit.register(wait_for_all)
del wait_for_all

__all__ = [
    "InsertReport",
    "LocalMap",
    "Map",
    "ScanIterator",
    "TileIterator",
    "VoxtileError",
    "build",
    "clear",
    "convert",
    "crop",
    "decay",
    "delete_snapshot",
    "diff",
    "digest",
    "errors",
    "export",
    "export_scans",
    "import_octree",
    "merge",
    "open",
    "remap",
    "remap_as",
    "remove_points",
    "remove_scans",
    "repair",
    "revert",
    "scans",
    "snapshot",
    "snapshots",
    "verify",
]
