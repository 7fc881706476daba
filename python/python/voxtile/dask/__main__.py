"""The command ``python -m voxtile.dask``."""

from __future__ import annotations

import argparse
import json
import os
import sys
from typing import Any

import dask.config
import distributed

from ..errors import ArgumentError, VoxtileError
from .building import build

# Its types are not complete.
_dask: Any = distributed

# Dask looks at its own processes fifty times a second, which takes 7 % of a core; and it has each worker give memory
# back to the system at once, which a map asks for again with the next scan.
_LOCAL = {
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "5s",
    "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": 128 << 20,
    "distributed.nanny.pre-spawn-environ.MALLOC_MMAP_THRESHOLD_": 32 << 20,
    "distributed.nanny.pre-spawn-environ.MALLOC_ARENA_MAX": 1,
}


def _arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m voxtile.dask",
        description="Makes one map of scans, or adds scans to one, with the workers of a dask cluster.",
    )
    parser.add_argument("scans", metavar="DATA", help="file or folder of scans, which all workers see")
    parser.add_argument("-o", "--output", metavar="MAP", required=True, help="the map")
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument("--scheduler", metavar="ADDRESS", help="a running cluster, such as tcp://host:8786")
    where.add_argument("--local", metavar="N", type=int, help="N processes of this machine")
    parser.add_argument("--resolution", metavar="M", type=float, help="edge of a voxel in metres; a new map needs it")
    parser.add_argument("--update", action="store_true", help="add the scans to the map, which exists")
    parser.add_argument("--region-size", metavar="M", type=float, help="edge of a region [default: by --max-range]")
    parser.add_argument("--tile-size", metavar="M", type=float)
    parser.add_argument("--min-range", metavar="M", type=float)
    parser.add_argument("--max-range", metavar="M", type=float)
    parser.add_argument("--memory", metavar="SIZE", help="of a task's map, such as 2GB")
    parser.add_argument("--storage", choices=["octomap", "compact"])
    parser.add_argument("--format", help="of the scans, where their content does not tell")
    parser.add_argument("--poses", metavar="FILE", help="poses of the scans")
    parser.add_argument("--json", action="store_true", help="print the report as JSON")
    return parser


def _progress(done: int, regions: int) -> None:
    if sys.stderr.isatty():
        filled = 40 * done // regions
        end = "\n" if done == regions else ""
        print(f"\r[{'#' * filled}{'.' * (40 - filled)}] {done} of {regions} regions", end=end, file=sys.stderr)


def _report(told: dict[str, Any]) -> None:
    before = f" ({told['regions_done_before']} done before)" if told["regions_done_before"] else ""
    print(f"{told['output']}: {told['regions']} regions of {told['region_size']:g} m{before}")
    print(f"{told['scans']} scans, read {told['scans_read']} times in all: overlap {told['overlap']:.2f}")
    if "cpu_seconds" in told:
        parts = ", ".join(
            f"{name} {told['seconds'][name]:.1f} s (CPU {told['cpu_seconds'][name]:.1f} s)" for name in told["seconds"]
        )
        print(f"{told['workers']} workers: {parts}")
    if told.get("slowest"):
        print(f"the slowest region took {told['skew']:.2f} of the mean:")
    for task in told["slowest"]:
        print(f"  region {task['column']}: {task['scans']} scans, {task['seconds']:.1f} s")


def main() -> int:
    """Exit codes: 0 the map is made, 1 it is not, 2 an argument is wrong."""
    arguments = vars(_arguments().parse_args())
    scans, output, as_json = (arguments.pop(name) for name in ("scans", "output", "json"))
    scheduler, workers = arguments.pop("scheduler"), arguments.pop("local")
    options = {name: value for name, value in arguments.items() if value is not None}
    if workers is not None and workers < 1:
        print("error: --local: it takes at least one process", file=sys.stderr)
        return 2
    try:
        if workers is None:
            client = _dask.Client(scheduler)
        else:
            # A worker is a task, and a task a core: more threads wait for each other and cost CPU.
            os.environ.setdefault("RAYON_NUM_THREADS", "1")
            with dask.config.set(_LOCAL):
                client = _dask.Client(n_workers=workers, threads_per_worker=1, processes=True)
        with client:
            print(f"dashboard: {client.dashboard_link}", file=sys.stderr)
            told = build(scans, output, client=client, progress=_progress, **options)
    except ArgumentError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except (VoxtileError, _dask.KilledWorker, OSError) as error:
        print(f"error: {error}\nThe same command goes on with the regions that are done.", file=sys.stderr)
        return 1
    if as_json:
        print(json.dumps(told))
    else:
        _report(told)
    return 0


if __name__ == "__main__":
    sys.exit(main())
