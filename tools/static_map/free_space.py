#!/usr/bin/env python3
"""Measures how much of the known free space of one map another map keeps.

    free_space.py SET MAP.npz OTHER.npz RESOLUTION_M MIN_RANGE_M MAX_RANGE_M

MAP.npz and OTHER.npz are outputs of `voxtile export --what all`, MAP.npz of a map by OctoMap's rule; the other
arguments are those of score.py. Of the voxels that are free in MAP.npz and contain no point of SET, prints the shares
that are free and unknown in OTHER.npz, in percent: two cells of a table row.
"""
import sys
from pathlib import Path

import numpy as np

from score import Scans, contains, keys_of, voxels_of


def main():
    folder, map_file, other_file = Path(sys.argv[1]), sys.argv[2], sys.argv[3]
    resolution_m, min_range_m, max_range_m = map(float, sys.argv[4:])
    _, free = voxels_of(map_file, resolution_m)
    occupied_there, free_there = voxels_of(other_file, resolution_m)
    hit = [np.zeros(0, np.int64)]
    for points, _, _ in Scans(folder, min_range_m, max_range_m):
        hit.append(np.unique(keys_of(points, resolution_m)))
    free = free[~contains(np.unique(np.concatenate(hit)), free)]
    shares = [contains(free_there, free), ~(contains(free_there, free) | contains(occupied_there, free))]
    print(" | ".join(f"{100 * np.count_nonzero(share) / max(len(free), 1):.1f}" for share in shares))


if __name__ == "__main__":
    main()
