"""Probabilistic 3D occupancy mapping for maps larger than memory.

A ``Map`` takes scans (``insert``) and answers queries of many points, rays and boxes at once. Lengths are in
metres, points are arrays of N x 3. Functions of this module work on whole maps on disk. Errors are the
exceptions of ``voxtile.errors``. Progress callbacks receive the work done and the total.

A forked process lacks the threads of its parent, so it cannot use the maps that its parent has opened: start
processes with ``spawn`` and open maps in them.
"""

import atexit

from . import errors
from ._voxtile import (
    Change,
    Comparison,
    DistanceField,
    Frontier,
    InsertReport,
    LocalMap,
    Map,
    ScanIterator,
    TileIterator,
    clean,
    clear,
    compare,
    compute_distances,
    convert,
    crop,
    decay,
    delete_snapshot,
    diff,
    forget_old,
    import_octree,
    merge,
    remap,
    remap_as,
    remove_points,
    remove_scans,
    scan_digest,
    repair,
    revert,
    snapshots,
    verify,
    wait_for_all,
)
from .errors import VoxtileError
from .files import build, export, export_scans, scans
from .whole_maps import digest, open, snapshot

# Interrupted work that cannot be cancelled is finished before the interpreter exits.
atexit.register(wait_for_all)
del wait_for_all

__all__ = [
    "Change",
    "Comparison",
    "DistanceField",
    "Frontier",
    "InsertReport",
    "LocalMap",
    "Map",
    "ScanIterator",
    "TileIterator",
    "VoxtileError",
    "build",
    "clean",
    "clear",
    "compare",
    "compute_distances",
    "convert",
    "crop",
    "decay",
    "delete_snapshot",
    "diff",
    "digest",
    "errors",
    "export",
    "export_scans",
    "forget_old",
    "import_octree",
    "merge",
    "open",
    "remap",
    "remap_as",
    "remove_points",
    "remove_scans",
    "scan_digest",
    "repair",
    "revert",
    "scans",
    "snapshot",
    "snapshots",
    "verify",
]
