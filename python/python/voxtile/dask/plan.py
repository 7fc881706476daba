"""The command ``python -m voxtile.dask.plan``: what a build in parts of a city would cost."""

from __future__ import annotations

import argparse
import json
import math
import sys

from .simulation import City, advised_region_size, simulate


def _arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m voxtile.dask.plan", description="Tells what a build in parts of a city would cost."
    )
    parser.add_argument("--streets-km", metavar="KM", type=float, default=10_000.0)
    parser.add_argument("--street-distance", metavar="M", type=float, default=200.0, help="between parallel streets")
    parser.add_argument("--scan-distance", metavar="M", type=float, default=1.0, help="between scans of a drive")
    parser.add_argument("--downtown", metavar="TIMES", type=int, default=1, help="how often the middle is driven")
    parser.add_argument("--max-range", metavar="M", type=float, default=60.0)
    parser.add_argument("--tile-size", metavar="M", type=float, default=10.0)
    parser.add_argument("--region-size", metavar="M", type=float, help="edge of a region [default: as build takes it]")
    parser.add_argument("--workers", metavar="N", type=int, nargs="+", default=[1, 10, 100, 1000])
    parser.add_argument("--json", action="store_true", help="print JSON")
    return parser


def main() -> int:
    """Exit codes: 0 told, 2 an argument is wrong."""
    given = _arguments().parse_args()
    city = City(given.streets_km, given.street_distance, given.scan_distance, given.downtown)
    size = given.region_size
    if size is None:
        size = advised_region_size(given.max_range, given.tile_size)
    numbers = {"--max-range": given.max_range, "--tile-size": given.tile_size, "--region-size": size}
    for name, value in numbers.items():
        if not (math.isfinite(value) and value > 0):
            print(f"error: {name}: {value} is not above 0", file=sys.stderr)
            return 2
    if min(given.workers) < 1:
        print("error: --workers: it takes at least one", file=sys.stderr)
        return 2
    try:
        told = simulate(
            city, region_size=size, reach=given.max_range, workers=given.workers, tile_size=given.tile_size
        )
    except ValueError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    if given.json:
        print(json.dumps(told))
        return 0
    cpu = told["cpu_seconds"]
    print(f"regions of {size:g} m: {told['tasks']} tasks, the longest {told['longest_task_seconds']:.0f} s")
    read = f"read {told['overlap']:.2f} times: {told['bytes_read'] / 1e12:.2f} TB"
    print(f"{told['scans']} scans, {read}; skew {told['skew']:.1f}")
    print(f"CPU {sum(cpu.values()) / 3600:.1f} h, {told['cpu_factor']:.2f} of one build")
    print("workers   first pass      regions        merge          all")
    for row in told["workers"]:
        hours = [row[f"{name}seconds"] / 3600 for name in ("plan_", "map_", "merge_", "")]
        print(f"{row['workers']:7}" + "".join(f"{hour:11.2f} h" for hour in hours))
    return 0


if __name__ == "__main__":
    sys.exit(main())
