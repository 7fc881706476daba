#!/usr/bin/env python3
"""Measures how well `voxtile clean` finds the points of moving objects.

    flags.py SET SCANS MIN_RANGE_M MAX_RANGE_M

SET is as for score.py, with labels. SCANS is the folder of `voxtile export MAP --scans SCANS` of a map of this set after
`clean`: the same scans, with a field `moving`. Prints the cells of a table row, all in percent:

- static accuracy SA: static and parked points that are not marked,
- dynamic accuracy DA: moving points that are marked,
- AA = sqrt(SA DA),
- points of parked cars that leave that are not marked.
"""
import math
import sys
from pathlib import Path

import numpy as np

from score import Scans, fields_of, natural


def main():
    folder, exported = Path(sys.argv[1]), Path(sys.argv[2])
    scans = Scans(folder, *map(float, sys.argv[3:]))
    files = sorted(exported.glob("*.pcd"), key=natural)
    if len(files) != len(scans.files):
        sys.exit(f"{exported} has {len(files)} scans, but {folder} has {len(scans.files)}")
    # Points and marked points of each label.
    count, marked = np.zeros((2, 256), np.int64)
    for (_, _, labels, used), file in zip(scans.with_selection(), files):
        fields = fields_of(file)
        if len(used) != len(fields):
            sys.exit(f"{file} has {len(fields)} points, but the scan of {folder} has {len(used)}")
        moving = fields["moving"][:, 0] != 0 if "moving" in fields.dtype.names else np.zeros(len(fields), bool)
        count += np.bincount(labels, minlength=256)
        marked += np.bincount(labels[moving[used]], minlength=256)
    sa = 100 * (1 - marked[:2].sum() / max(count[:2].sum(), 1))
    da = 100 * marked[2] / max(count[2], 1)
    departed = f"{100 * (1 - marked[3] / count[3]):.1f}" if count[3] else ""
    print(" | ".join([f"{sa:.2f}", f"{da:.1f}", f"{math.sqrt(sa * da):.1f}", departed]))


if __name__ == "__main__":
    main()
