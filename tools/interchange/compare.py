#!/usr/bin/env python3
"""Checks that each point that another program read from a file is in its voxel of the map.

    compare.py MAP.csv RESOLUTION FILE PROGRAM [--any-order] < POINTS

MAP.csv is the map's export without an origin; FILE.origin.json, if it exists, has the offset of FILE's
points. A line `# origin X Y Z` before the points (from a PCD's VIEWPOINT) must match it. Needs only Python.
"""
import csv
import json
import math
import pathlib
import sys


def main():
    table, resolution, path, program = sys.argv[1], float(sys.argv[2]), sys.argv[3], sys.argv[4]

    def voxel(point):
        return tuple(math.floor(x / resolution) for x in point)

    with open(table, newline="") as rows:
        expected = [voxel(float(row[k]) for k in "xyz") for row in csv.DictReader(rows)]
    sidecar = pathlib.Path(path + ".origin.json")
    origin = json.loads(sidecar.read_text())["origin_m"] if sidecar.exists() else [0.0, 0.0, 0.0]
    found, worst = [], 0.0
    for line in sys.stdin:
        words = line.replace(",", " ").split()
        if words[:2] == ["#", "origin"]:
            reported = [float(x) for x in words[2:5]]
            if reported != origin:
                sys.exit(f"{program}: {path}: the reported origin is {reported}, not {origin}")
        elif words and not words[0].startswith(("#", "/")):
            point = [float(x) + o for x, o in zip(words[:3], origin)]
            found.append(voxel(point))
            worst = max(worst, *(abs(x / resolution - math.floor(x / resolution) - 0.5) for x in point))
    if "--any-order" in sys.argv:
        expected.sort()
        found.sort()
    if len(found) != len(expected):
        sys.exit(f"{program}: {path}: {len(found)} points, the map has {len(expected)} occupied voxels")
    wrong = sum(a != b for a, b in zip(found, expected))
    if wrong or not found:
        sys.exit(f"{program}: {path}: {wrong} of {len(found)} points are not in their voxel")
    name = pathlib.Path(path).name
    print(f"{program:12} {name:14} {len(found):8} points, each in its voxel; at most {worst:.5f} voxels from its center")


if __name__ == "__main__":
    main()
