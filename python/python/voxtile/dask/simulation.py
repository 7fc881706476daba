"""Estimates of tasks, bytes and time of a distributed build of a city, without its scans.

Streets are lines at equal distances, along x and along y; a car drives each once. Regions are planned as in a build;
times are counts multiplied by ``Costs``.
"""

from __future__ import annotations

import heapq
import math
from dataclasses import asdict, dataclass
from typing import Any

from .regions import Box, columns_of, scans_in


@dataclass(frozen=True)
class Costs:
    """CPU seconds and bytes. Measured on 120 scans: docs/cluster.md."""

    # First pass: decoding a scan, its box, and its fingerprint.
    plan_scan_s: float = 0.00016
    # A scan read by the task of a region, whether or not it changes a voxel there.
    read_scan_s: float = 0.0008
    # Mapping a scan, over all regions that it reaches.
    map_scan_s: float = 0.0111
    # Opening and flushing the map of a task, without the overhead of dask.
    task_s: float = 0.01
    # Moving a tile to its place.
    shard_tile_s: float = 0.00007
    # A tile in the final join, which runs in one process.
    merge_tile_s: float = 0.00014
    # A scan of 8000 points in a file of float32.
    scan_bytes: int = 90_000


@dataclass(frozen=True)
class City:
    """A square of streets. In the center, a ninth of the area, each street is driven ``downtown_times``."""

    streets_km: float = 10_000.0
    street_distance_m: float = 200.0
    scan_distance_m: float = 1.0
    downtown_times: int = 1


# Allowed CPU time of a distributed build, as a multiple of that of one build.
_CPU_GOAL = 1.3
# Default range: that of automotive lidars.
_USUAL_RANGE_M = 100.0
_TILES_STEP = 10
# With wider regions there would be too few tasks to distribute.
_MAX_TILES = 1000


def cpu_factor(region_size: float, reach: float, costs: Costs = Costs()) -> float:
    """Returns the CPU time of a distributed build of a straight drive, without the final join, as a multiple of that of
    a single build.
    """
    # A region also reads the scans outside it that reach it, at both ends of the street.
    read_times = (region_size + 2 * reach) / region_size
    scans_of_region = max(region_size, 1.0)
    one = costs.read_scan_s + costs.map_scan_s
    parts = costs.plan_scan_s + read_times * costs.read_scan_s + costs.map_scan_s + costs.task_s / scans_of_region
    return parts / one


def advised_region_size(max_range: float | None, tile_size: float, costs: Costs = Costs()) -> float:
    """Returns the edge of the smallest region, in metres, that keeps CPU time within 1.3 of one build.

    Small regions balance the load. If no size reaches the goal, returns the first size for which twice the size
    would reduce the multiple by less than 0.01.
    """
    reach = _USUAL_RANGE_M if max_range is None else max_range
    for tiles in range(2 * _TILES_STEP, _MAX_TILES + 1, _TILES_STEP):
        size = tiles * tile_size
        factor = cpu_factor(size, reach, costs)
        if factor <= _CPU_GOAL or factor - cpu_factor(2 * size, reach, costs) < 0.01:
            return size
    return _MAX_TILES * tile_size


def simulate(
    city: City, *, region_size: float, reach: float, workers: list[int], tile_size: float = 10.0, costs: Costs = Costs()
) -> dict[str, Any]:
    """Plans a build of a city and simulates it: each free worker takes the longest remaining task."""
    edge = _edge(city)
    boxes, weights = _drive(city, edge, reach)
    columns = columns_of(boxes, region_size, tile_size, joined_gap=1)
    before = [0]
    for weight in weights:
        before.append(before[-1] + weight)
    tasks, read = [], 0
    for (x, y), ranges in columns.items():
        scans = sum(before[last] - before[first] for first, last in ranges)
        share = sum(
            weights[number] * _share(boxes[number], x, y, region_size)
            for first, last in ranges
            for number in range(first, last)
        )
        read += scans
        tasks.append(costs.task_s + scans * costs.read_scan_s + share * costs.map_scan_s)
    scans = before[-1]
    # Tiles of the ground and of objects on it, within the range of a scan.
    tiles = _TILES_HIGH * _ground_tiles(city, edge, reach, tile_size)
    tasks = sorted((task + tiles / len(tasks) * costs.shard_tile_s for task in tasks), reverse=True)
    plan_s, merge_s = scans * costs.plan_scan_s, tiles * costs.merge_tile_s
    cpu_s = plan_s + sum(tasks) + merge_s
    one_build_s = scans * (costs.read_scan_s + costs.map_scan_s)
    return {
        "city": asdict(city),
        "region_size": region_size,
        "scans": scans,
        "tasks": len(tasks),
        "scans_read": read,
        "overlap": read / scans,
        "bytes_read": (read + scans) * costs.scan_bytes,
        "cpu_seconds": {"plan": plan_s, "map": sum(tasks), "merge": merge_s},
        "cpu_factor": cpu_s / one_build_s,
        "skew": tasks[0] * len(tasks) / sum(tasks),
        "longest_task_seconds": tasks[0],
        "workers": [
            {
                "workers": count,
                "plan_seconds": plan_s / count,
                "map_seconds": _makespan(tasks, count),
                "merge_seconds": merge_s,
                "seconds": plan_s / count + _makespan(tasks, count) + merge_s,
            }
            for count in workers
        ],
    }


# Number of tiles, one above the other, that a scan of a street changes.
_TILES_HIGH = 2


def _ground_tiles(city: City, edge: float, reach: float, tile_size: float) -> float:
    """Number of ground tiles that scans reach: a band along each street, with crossings counted once."""
    covered = min(2 * reach / city.street_distance_m, 1.0)
    return (1 - (1 - covered) ** 2) * (edge / tile_size) ** 2


def _edge(city: City) -> float:
    """Edge of the square in which the streets have the given total length."""
    for name, value in asdict(city).items():
        if not (math.isfinite(value) and value > 0):
            raise ValueError(f"{name}: must be greater than 0, not {value}")
    streets = max(round(math.sqrt(city.streets_km * 1000.0 / (2 * city.street_distance_m))), 1)
    return streets * city.street_distance_m


# Scans are planned in groups, so that a simulation of a city takes seconds.
_GROUP_M = 20.0


def _drive(city: City, edge: float, reach: float) -> tuple[list[Box | None], list[int]]:
    """Returns the box around each group of scans, and the number of scans in it, in the order of the drive."""
    boxes: list[Box | None] = []
    weights: list[int] = []
    scans = max(round(_GROUP_M / city.scan_distance_m), 1)
    streets, groups = round(edge / city.street_distance_m), math.ceil(edge / _GROUP_M)
    for is_along_y in (False, True):
        for street in range(streets):
            across = (street + 0.5) * city.street_distance_m
            order = range(groups) if street % 2 == 0 else range(groups - 1, -1, -1)
            for group in order:
                along = (group + 0.5) * _GROUP_M
                is_downtown = edge / 3 <= across < 2 * edge / 3 and edge / 3 <= along < 2 * edge / 3
                x, y = (across, along) if is_along_y else (along, across)
                boxes.append((x - reach, y - reach, x + reach, y + reach))
                weights.append(scans * (city.downtown_times if is_downtown else 1))
    return boxes, weights


def _share(box: Box | None, x: int, y: int, size: float) -> float:
    """Returns the fraction of a box that is in a column."""
    if box is None:
        return 0.0
    west, south, east, north = box
    wide = min(east, (x + 1) * size) - max(west, x * size)
    high = min(north, (y + 1) * size) - max(south, y * size)
    return max(wide, 0.0) * max(high, 0.0) / ((east - west) * (north - south))


def _makespan(tasks: list[float], workers: int) -> float:
    free = [0.0] * min(workers, len(tasks))
    for seconds in tasks:
        heapq.heapreplace(free, free[0] + seconds)
    return max(free, default=0.0)
