"""Benchmark of the same inserts and queries from Python and from Rust: CPU seconds, medians of alternating runs.

    cargo build --release -p peers --bin rust_queries

    python benchmarks/beside_rust.py ../target/release/rust_queries [RUNS]

Each run is a separate process with a new map. On a noisy machine compare the minimum times rather than the medians.
Needs the package as `maturin build --release` builds it.
"""

from __future__ import annotations

import json
import statistics
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from beside_pyoctomap import RESOLUTION_M, cpu_s, directions, places, scan

SCANS = 60


def write(path: Path) -> None:
    """Writes the inputs for the Rust program."""
    with path.open("wb") as file:
        file.write(struct.pack("<Q", SCANS))
        for number in range(SCANS):
            points, sensor = scan(number % 20)
            file.write(sensor.astype("<f8").tobytes() + struct.pack("<Q", len(points)))
            file.write(points.astype("<f4").tobytes())
        for numbers in (places(), directions()):
            file.write(struct.pack("<Q", len(numbers)) + numbers.astype("<f8").tobytes())


def run(folder: Path) -> dict[str, float]:
    import voxtile

    scans = [scan(number % 20) for number in range(SCANS)]
    narrow = [(points.astype(np.float32), sensor) for points, sensor in scans]
    at, ways = places(), directions()
    with voxtile.Map.create(folder, RESOLUTION_M) as found:
        insert = cpu_s(lambda: [found.insert(points, origin=sensor) for points, sensor in narrow])
        flush = cpu_s(found.flush)
    with voxtile.open(folder) as found:
        found.occupancy(at)
        query = cpu_s(lambda: found.occupancy(at))
        rays = cpu_s(lambda: found.cast_rays([15.0, 10.0, 1.5], ways, max_range=40.0))
        nearest = cpu_s(lambda: found.nearest(at[: len(ways)], 10.0))
    return {"insert": insert, "flush": flush, "query": query, "rays": rays, "nearest": nearest}


def main() -> None:
    if sys.argv[1:2] == ["--one"]:
        print(json.dumps(run(Path(sys.argv[2]))))
        return
    program, runs = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 7
    found: dict[str, list[dict[str, float]]] = {"Python": [], "Rust": []}
    with tempfile.TemporaryDirectory() as folder:
        write(Path(folder) / "work")
        for number in range(runs):
            for name, list_of_runs in found.items():
                at = f"{folder}/{name}{number}"
                command = {"Python": [sys.executable, __file__, "--one", at], "Rust": [program, f"{folder}/work", at]}
                output = subprocess.run(command[name], check=True, capture_output=True, text=True)
                list_of_runs.append(json.loads(output.stdout))
    rows = {
        "insert": (f"{SCANS} scans of 20,000 points", 1e3 / SCANS, "ms a scan"),
        "query": (f"{len(places()):,} points", 1e9 / len(places()), "ns a point"),
        "rays": (f"{len(directions()):,} rays", 1e6 / len(directions()), "us a ray"),
        "nearest": (f"{len(directions()):,} points", 1e6 / len(directions()), "us a point"),
        "flush": ("the map to disk", 1e3, "ms"),
    }
    print("| what | Rust | Python | times | of the least |\n|---|---:|---:|---:|---:|")
    for key, (what, scale, unit) in rows.items():
        ours, theirs = (scale * statistics.median(run[key] for run in found[name]) for name in found)
        ratio = statistics.median(a[key] / b[key] for a, b in zip(found["Python"], found["Rust"], strict=True))
        least = {name: min(run[key] for run in runs_of) for name, runs_of in found.items()}
        least_ratio = least["Python"] / least["Rust"]
        print(f"| {key}: {what}, {unit} | {theirs:.2f} | {ours:.2f} | {ratio:.2f} | {least_ratio:.2f} |")


if __name__ == "__main__":
    main()
