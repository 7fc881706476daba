"""What a build in parts would take: regions, bytes, and time by the number of workers, before anybody rents them.

``python -m voxtile.dask.plan --street-km 10000`` prints it. Lengths are in metres, times in seconds.
"""

from __future__ import annotations

import argparse
import heapq
import json
import math
import random
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass

# Of maps whose rays have no limit.
_DEFAULT_RANGE_M = 100.0
# Edge of the advised region, in ranges: what the simulation says (docs/cluster.md).
_RANGES_OF_REGION = 8


@dataclass(frozen=True)
class Costs:
    """CPU times of one core, and sizes: of a lidar car of 8000 rays a scan, at 0.1 m with rays of 60 m.

    Measured with 400 scans of ``workload drive`` and ``voxtile build --threads 1``: whole, in regions of 100 to 400 m,
    and in a region without a tile.
    """

    read_scan_s: float = 0.8e-3
    """Reading a scan that a region does not need, or not all of it."""
    map_scan_s: float = 40e-3
    """Mapping it, in however many regions, with what is written of it."""
    look_at_scan_s: float = 2.5e-3
    """The first pass."""
    begin_task_s: float = 0.5
    """Beginning a task, and putting what it made beside the others."""
    adopt_tile_s: float = 1e-3
    """Taking over a tile in the end, in one process."""
    scan_bytes: float = 121e3
    tile_bytes: float = 1.6e6


@dataclass(frozen=True)
class City:
    """Streets and how they were driven. ``density`` is metres of street a square metre."""

    street_km: float = 10_000.0
    density: float = 0.01
    downtown_share: float = 0.2
    """Of the streets, in a downtown where they are ``downtown_density`` times as dense."""
    downtown_density: float = 10.0
    scan_spacing_m: float = 1.0


@dataclass(frozen=True)
class Plan:
    """What one size of regions comes to."""

    region_size_m: float
    tasks: int
    scans: int
    scans_read: int
    overlap: float
    """How often a scan is read."""
    bytes_read: float
    bytes_written: float
    cpu_s: float
    skew: float
    """The longest task by the mean."""
    wall_s: dict[int, float]
    """By the number of workers, of one core each."""


def simulate(
    region_size: float,
    *,
    max_range: float = 60.0,
    tile_size: float = 10.0,
    city: City | None = None,
    costs: Costs | None = None,
    workers: Sequence[int] = (1, 10, 100, 1000),
) -> Plan:
    """Plans a city in regions of this size, and lets workers take tasks, the longest first.

    Streets lie in both directions, so a scan is read by all regions that the square around it reaches. Regions have
    half to one and a half times the streets of the mean.
    """
    city, costs = city or City(), costs or Costs()
    overlap = ((region_size + 2 * (max_range + tile_size)) / region_size) ** 2
    tasks, scans, tiles = [], 0, 0.0
    chance = random.Random(1)
    for share, density in [
        (1 - city.downtown_share, city.density),
        (city.downtown_share, city.density * city.downtown_density),
    ]:
        length = 1000 * city.street_km * share
        count = max(math.ceil(length / (density * region_size**2)), 1 if share > 0 else 0)
        weights = [chance.uniform(0.5, 1.5) for _ in range(count)]
        for weight in weights:
            metres = length * weight / sum(weights)
            own = round(metres / city.scan_spacing_m)
            # Three layers of tiles; where streets are dense they see the same ones.
            seen = 3 * min(metres * 2 * max_range, region_size**2) / tile_size**2
            tasks.append(costs.begin_task_s + own * (overlap * costs.read_scan_s + costs.map_scan_s))
            scans += own
            tiles += seen
    tasks.sort(reverse=True)
    one_process = tiles * costs.adopt_tile_s
    first_pass = scans * costs.look_at_scan_s
    wall = {count: first_pass / count + _makespan(tasks, count) + one_process for count in workers}
    read = round(scans * overlap)
    return Plan(
        region_size_m=region_size,
        tasks=len(tasks),
        scans=scans,
        scans_read=read,
        overlap=overlap,
        bytes_read=(scans + read) * costs.scan_bytes,
        bytes_written=tiles * costs.tile_bytes,
        cpu_s=first_pass + sum(tasks) + one_process,
        skew=tasks[0] * len(tasks) / sum(tasks),
        wall_s=wall,
    )


def advised_region_size(max_range: float | None, tile_size: float) -> float:
    """The edge of a region where nobody names one: eight ranges, in whole tiles."""
    size = _RANGES_OF_REGION * (_DEFAULT_RANGE_M if max_range is None else max_range)
    return tile_size * max(math.ceil(size / tile_size), 2)


def _makespan(longest_first: Sequence[float], workers: int) -> float:
    """When the last worker is done, if each takes the next task as soon as it is free."""
    free = [0.0] * min(workers, len(longest_first))
    for task in longest_first:
        heapq.heapreplace(free, free[0] + task)
    return max(free)


def _hours(seconds: float) -> str:
    return f"{seconds / 3600:.1f} h" if seconds >= 3600 else f"{seconds / 60:.1f} min"


def _table(plans: Sequence[Plan]) -> str:
    counts = list(plans[0].wall_s)
    names = ["region (m)", "tasks", "read (TB)", "overlap", "skew", "CPU", *(f"{count} workers" for count in counts)]
    rows = [names, ["---:"] * len(names)]
    for plan in plans:
        numbers = [f"{plan.region_size_m:g}", f"{plan.tasks:,}", f"{plan.bytes_read / 1e12:.2f}", f"{plan.overlap:.2f}"]
        numbers += [f"{plan.skew:.1f}", _hours(plan.cpu_s), *(_hours(plan.wall_s[count]) for count in counts)]
        rows.append(numbers)
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)


def main() -> int:
    """Exit codes: 0, and 2 for a wrong argument."""
    city = City()
    parser = argparse.ArgumentParser(
        prog="python -m voxtile.dask.plan",
        description="What a build in parts would take, by the size of regions and the number of workers.",
    )
    parser.add_argument("--street-km", metavar="KM", type=float, default=city.street_km, help="length of all drives")
    parser.add_argument("--max-range", metavar="M", type=float, default=60.0, help="of rays")
    parser.add_argument("--tile-size", metavar="M", type=float, default=10.0)
    parser.add_argument("--map-scan", metavar="S", type=float, help="CPU time of a scan, as `voxtile build` tells it")
    parser.add_argument("--workers", metavar="N", type=int, nargs="+", default=[1, 10, 100, 1000])
    parser.add_argument("--region-size", metavar="M", type=float, nargs="+", help="default: around the advised one")
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    positive = [given.street_km, given.max_range, given.tile_size, *given.workers, *(given.region_size or [])]
    if not all(math.isfinite(number) and number > 0 for number in positive):
        print("error: lengths and numbers of workers are more than nothing", file=sys.stderr)
        return 2
    advised = advised_region_size(given.max_range, given.tile_size)
    sizes = given.region_size or [advised / 4, advised / 2, advised, 2 * advised, 4 * advised]
    costs = Costs() if given.map_scan is None else Costs(map_scan_s=given.map_scan)
    plans = [
        simulate(
            size,
            max_range=given.max_range,
            tile_size=given.tile_size,
            city=City(street_km=given.street_km),
            costs=costs,
            workers=given.workers,
        )
        for size in sizes
    ]
    if given.json:
        print(json.dumps({"advised_region_size_m": advised, "plans": [asdict(plan) for plan in plans]}))
    else:
        print(_table(plans))
        print(f"advised: {advised:g} m")
    return 0


if __name__ == "__main__":
    sys.exit(main())
