#!/usr/bin/env python3
"""Runs DUFOMap (PyPI `dufomap`) on a labelled set.

    dufomap_row.py SET RESOLUTION_M MIN_RANGE_M MAX_RANGE_M D_S_M D_P [--cluster]

SET as in score.py. D_S_M (distance by which hits are inflated, metres) and D_P (voxels by which unknown space is
inflated) are DUFOMap's settings; --cluster enables its clustering. DUFOMap gets all points; its labels are scored
within the range. Prints the cells of a table row: those of score.py with "labelled static" for "in an occupied voxel";
CPU seconds a scan of the map, CPU seconds a scan of map and labels, and peak memory in MB. Threads: 1.
"""
import os
import resource
import sys
from pathlib import Path

import numpy as np
from dufomap import dufomap

from score import Scans, Tally, keys_of, keys_of_static_points, points_of


def cpu_s():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def main():
    arguments = [argument for argument in sys.argv[1:] if not argument.startswith("--")]
    folder = Path(arguments[0])
    resolution_m, min_range_m, max_range_m, d_s_m, d_p = map(float, arguments[1:])
    scans = Scans(folder, min_range_m, max_range_m)
    # DUFOMap prints progress on standard output.
    output = os.dup(1)
    os.dup2(2, 1)
    mapper = dufomap(resolution_m, d_s_m, int(d_p), num_threads=1)

    def inputs():
        for path, pose in zip(scans.files, scans.poses):
            xyz, labels = points_of(path)
            yield xyz.astype(np.float32), np.vstack([pose, [0, 0, 0, 1]]), labels

    map_s = label_s = 0.0
    for points, pose, _ in inputs():
        start_s = cpu_s()
        mapper.run(points, pose, cloud_transform=True)
        map_s += cpu_s() - start_s
    start_s = cpu_s()
    mapper.oncePropagateCluster(if_propagate=True, if_cluster="--cluster" in sys.argv)
    map_s += cpu_s() - start_s
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    tally, kept, count = Tally(keys_of_static_points(scans, resolution_m)), 0, 0
    for points, pose, labels in inputs():
        start_s = cpu_s()
        is_static = np.asarray(mapper.segment(points, pose, cloud_transform=True)).reshape(-1) == 0
        label_s += cpu_s() - start_s
        distance_m = np.linalg.norm(points, axis=1)
        used = (distance_m > min_range_m) & (distance_m < max_range_m)
        world = points[used].astype(np.float64) @ pose[:3, :3].T + pose[:3, 3]
        tally.add(keys_of(world, resolution_m), is_static[used], labels[used], distance_m[used])
        kept, count = kept + np.count_nonzero(is_static[used]), count + np.count_nonzero(used)
    number = len(scans.files)
    cells = [f"{100 * kept / max(count, 1):.1f}", *tally.cells()]
    cells += [f"{map_s / number:.3f}", f"{(map_s + label_s) / number:.3f}", f"{peak_mb:.0f}"]
    os.write(output, (" | ".join(cells) + "\n").encode())


if __name__ == "__main__":
    main()
