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

# The type hints of `distributed` are incomplete.
_dask: Any = distributed

# Dask samples its own processes fifty times a second, which costs 7 % of a core. It also makes workers return memory to
# the system at once, although the next scan needs it again.
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
        description="Builds a map from scans, or adds scans to a map, on a dask cluster.",
    )
    parser.add_argument("scans", metavar="DATA", help="file or folder of scans that all workers can read")
    parser.add_argument("-o", "--output", metavar="MAP", required=True, help="map to write")
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument("--scheduler", metavar="ADDRESS", help="a running cluster, such as tcp://host:8786")
    where.add_argument("--local", metavar="N", type=int, help="start N processes on this machine")
    parser.add_argument("--resolution", metavar="M", type=float, help="edge of a voxel in metres, for a new map")
    parser.add_argument("--update", action="store_true", help="add the scans to an existing map")
    parser.add_argument("--region-size", metavar="M", type=float, help="edge of a region [default: from --max-range]")
    parser.add_argument("--tile-size", metavar="M", type=float)
    parser.add_argument("--min-range", metavar="M", type=float)
    parser.add_argument("--max-range", metavar="M", type=float)
    parser.add_argument("--memory", metavar="SIZE", help="memory limit of each task's map, such as 2GB")
    parser.add_argument("--storage", choices=["octomap", "compact"])
    parser.add_argument("--format", help="format of the scans, if their content does not identify it")
    parser.add_argument("--poses", metavar="FILE", help="file with the poses of the scans")
    parser.add_argument("--keep-scans", action="store_true", help="keep the scans, so that the map can be remapped")
    parser.add_argument("--json", action="store_true", help="print the report as JSON")
    return parser


def _progress(done: int, regions: int) -> None:
    if sys.stderr.isatty():
        filled = 40 * done // regions
        end = "\n" if done == regions else ""
        print(f"\r[{'#' * filled}{'.' * (40 - filled)}] {done} of {regions} regions", end=end, file=sys.stderr)


def _report(report: dict[str, Any]) -> None:
    before = f" ({report['regions_done_before']} done before)" if report["regions_done_before"] else ""
    print(f"{report['output']}: {report['regions']} regions of {report['region_size']:g} m{before}")
    print(f"{report['scans']} scans, read {report['scans_read']} times in all: overlap {report['overlap']:.2f}")
    if "cpu_seconds" in report:
        parts = ", ".join(
            f"{name} {seconds:.1f} s (CPU {report['cpu_seconds'][name]:.1f} s)"
            for name, seconds in report["seconds"].items()
        )
        print(f"{report['workers']} workers: {parts}")
    if report.get("slowest"):
        print(f"the slowest region took {report['skew']:.2f} of the mean:")
    for task in report["slowest"]:
        print(f"  region {task['column']}: {task['scans']} scans, {task['seconds']:.1f} s")


def main() -> int:
    """Runs the command. Exit codes: 0 success, 1 failure, 2 wrong argument."""
    arguments = vars(_arguments().parse_args())
    scans, output, as_json = (arguments.pop(name) for name in ("scans", "output", "json"))
    scheduler, workers = arguments.pop("scheduler"), arguments.pop("local")
    options = {name: value for name, value in arguments.items() if value is not None and value is not False}
    if workers is not None and workers < 1:
        print("error: --local: must be at least 1", file=sys.stderr)
        return 2
    try:
        if workers is None:
            client = _dask.Client(scheduler)
        else:
            # Each worker runs one task on one core: more threads would compete and cost CPU time.
            os.environ.setdefault("RAYON_NUM_THREADS", "1")
            with dask.config.set(_LOCAL):
                client = _dask.Client(n_workers=workers, threads_per_worker=1, processes=True)
        with client:
            print(f"dashboard: {client.dashboard_link}", file=sys.stderr)
            report = build(scans, output, client=client, progress=_progress, **options)
    except ArgumentError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except (VoxtileError, _dask.KilledWorker, OSError) as error:
        print(f"error: {error}\nRun the same command again to resume: finished regions are kept.", file=sys.stderr)
        return 1
    if as_json:
        print(json.dumps(report))
    else:
        _report(report)
    return 0


if __name__ == "__main__":
    sys.exit(main())
