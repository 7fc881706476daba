"""The command ``python -m voxtile.dask.plan``: estimates the cost of mapping a city on a cluster."""

from __future__ import annotations

import argparse
import json
import math
import sys

from .simulation import City, advised_region_size, simulate


def _arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m voxtile.dask.plan", description="Estimates the cost of mapping a city on a dask cluster."
    )
    parser.add_argument("--streets-km", metavar="KM", type=float, default=10_000.0)
    parser.add_argument("--street-distance", metavar="M", type=float, default=200.0, help="between parallel streets")
    parser.add_argument("--scan-distance", metavar="M", type=float, default=1.0, help="between scans of a drive")
    parser.add_argument("--downtown", metavar="TIMES", type=int, default=1, help="drives per street in the center")
    parser.add_argument("--max-range", metavar="M", type=float, default=60.0)
    parser.add_argument("--tile-size", metavar="M", type=float, default=10.0)
    parser.add_argument("--region-size", metavar="M", type=float, help="edge of a region [default: that of a build]")
    parser.add_argument("--workers", metavar="N", type=int, nargs="+", default=[1, 10, 100, 1000])
    parser.add_argument("--json", action="store_true", help="print JSON")
    return parser


def main() -> int:
    """Runs the command. Exit codes: 0 success, 2 wrong argument."""
    given = _arguments().parse_args()
    city = City(given.streets_km, given.street_distance, given.scan_distance, given.downtown)
    size = given.region_size
    if size is None:
        size = advised_region_size(given.max_range, given.tile_size)
    numbers = {"--max-range": given.max_range, "--tile-size": given.tile_size, "--region-size": size}
    for name, value in numbers.items():
        if not (math.isfinite(value) and value > 0):
            print(f"error: {name}: must be greater than 0, not {value}", file=sys.stderr)
            return 2
    if min(given.workers) < 1:
        print("error: --workers: must be at least 1", file=sys.stderr)
        return 2
    try:
        plan = simulate(
            city, region_size=size, reach=given.max_range, workers=given.workers, tile_size=given.tile_size
        )
    except ValueError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    if given.json:
        print(json.dumps(plan))
        return 0
    cpu = plan["cpu_seconds"]
    print(f"regions of {size:g} m: {plan['tasks']} tasks, the longest {plan['longest_task_seconds']:.0f} s")
    read = f"read {plan['overlap']:.2f} times: {plan['bytes_read'] / 1e12:.2f} TB"
    print(f"{plan['scans']} scans, {read}; skew {plan['skew']:.1f}")
    print(f"CPU {sum(cpu.values()) / 3600:.1f} h, {plan['cpu_factor']:.2f} of one build")
    print("workers   first pass      regions        merge          all")
    for row in plan["workers"]:
        hours = [row[f"{name}seconds"] / 3600 for name in ("plan_", "map_", "merge_", "")]
        print(f"{row['workers']:7}" + "".join(f"{hour:11.2f} h" for hour in hours))
    return 0


if __name__ == "__main__":
    sys.exit(main())
