"""Benchmark of voxtile and `pyoctomap` on the same synthetic clouds: CPU seconds, medians of alternating runs.

    python benchmarks/beside_pyoctomap.py [RUNS]

Needs `pip install pyoctomap`. Each run is a separate process, to measure its memory.
"""

from __future__ import annotations

import json
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

RESOLUTION_M = 0.1
SCANS, POINTS, QUESTIONS, RAYS = 20, 20_000, 200_000, 5_000


def scan(number: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Returns points on the walls of a hall of 30 x 20 x 6 m, and the sensor position, in the world's frame."""
    random = np.random.default_rng(number)
    sensor = np.array([3.0 + number, 10.0, 1.5])
    directions = random.normal(size=(POINTS, 3))
    low, high = -sensor, np.array([30.0, 20.0, 6.0]) - sensor
    ends = np.maximum(low / directions, high / directions).min(axis=1)
    points = sensor + directions * ends[:, None]
    return points.astype(np.float32).astype(np.float64), sensor


def places() -> NDArray[np.float64]:
    return np.random.default_rng(0).uniform([0, 0, 0], [30, 20, 6], (QUESTIONS, 3))


def directions() -> NDArray[np.float64]:
    return np.random.default_rng(1).normal(size=(RAYS, 3))


def cpu_s(work: Callable[[], object]) -> float:
    began = time.process_time()
    work()
    return time.process_time() - began


def voxtile_run(folder: Path) -> dict[str, float]:
    import voxtile

    scans = [scan(number) for number in range(SCANS)]
    with voxtile.Map.create(folder / "map", RESOLUTION_M) as found:
        insert = cpu_s(lambda: [found.insert(points, origin=origin) for points, origin in scans])
        at, ways = places(), directions()
        query = cpu_s(lambda: found.occupancy(at))
        rays = cpu_s(lambda: found.cast_rays([15.0, 10.0, 1.5], ways, max_range=40.0))
        flush = cpu_s(found.flush)
    return {"insert": insert, "query": query, "rays": rays, "write": flush}


def pyoctomap_run(folder: Path) -> dict[str, float]:
    import pyoctomap

    scans = [scan(number) for number in range(SCANS)]
    tree = pyoctomap.OcTree(RESOLUTION_M)
    insert = cpu_s(lambda: [tree.insertPointCloud(points, origin) for points, origin in scans])
    at, ways, origin = places(), directions(), np.array([15.0, 10.0, 1.5])
    query = cpu_s(lambda: [tree.search(place) for place in at])
    end = np.zeros(3)
    rays = cpu_s(lambda: [tree.castRay(origin, way, end, True, 40.0) for way in ways])
    write = cpu_s(lambda: tree.write(str(folder / "tree.ot")))
    return {"insert": insert, "query": query, "rays": rays, "write": write}


def alone(name: str) -> dict[str, float]:
    output = subprocess.run([sys.executable, __file__, "--one", name], check=True, capture_output=True, text=True)
    found: dict[str, float] = json.loads(output.stdout)
    return found


def main() -> None:
    if sys.argv[1:2] == ["--one"]:
        run = {"voxtile": voxtile_run, "pyoctomap": pyoctomap_run}[sys.argv[2]]
        with tempfile.TemporaryDirectory() as folder:
            found = run(Path(folder))
        found["memory"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(json.dumps(found))
        return
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    found: dict[str, list[dict[str, float]]] = {"voxtile": [], "pyoctomap": []}
    for _ in range(runs):
        for name, list_of_runs in found.items():
            list_of_runs.append(alone(name))
    rows = {
        "insert": (f"{SCANS} scans of {POINTS:,} points", 1e3 / SCANS, "ms a scan"),
        "query": (f"{QUESTIONS:,} points", 1e6 / QUESTIONS, "us a point"),
        "rays": (f"{RAYS:,} rays", 1e6 / RAYS, "us a ray"),
        "write": ("the map to disk", 1e3, "ms"),
        "memory": ("of the process", 1, "MiB"),
    }
    print("| what | voxtile | pyoctomap | times |\n|---|---:|---:|---:|")
    for key, (what, scale, unit) in rows.items():
        ours, theirs = (scale * statistics.median(run[key] for run in found[name]) for name in found)
        print(f"| {key}: {what}, {unit} | {ours:.2f} | {theirs:.2f} | {theirs / ours:.1f} |")


if __name__ == "__main__":
    main()
