"""Times edt and scipy on the obstacles of a box, and compares voxtile's distances with edt's.

usage: peers.py FOLDER SET RESOLUTION CAP; prints rows of a Markdown table
"""

import sys
import time
from importlib.metadata import version

import edt
import numpy as np
import scipy
import scipy.ndimage


def timed(work):
    start = time.process_time()
    result = work()
    return result, time.process_time() - start


def main() -> int:
    folder, name, resolution, cap = sys.argv[1], sys.argv[2], float(sys.argv[3]), float(sys.argv[4])
    free = np.load(f"{folder}/obstacles.npy") == 0
    ours = np.load(f"{folder}/distances.npy")
    millions = free.size / 1e6
    squared, edt_s = timed(lambda: edt.edtsq(free, black_border=False, parallel=1))
    _, scipy_s = timed(lambda: scipy.ndimage.distance_transform_edt(free))
    # Obstacles around the box count for voxtile alone, so its border is not compared.
    reach = int(cap / resolution)
    inner = tuple(slice(min(reach, edge // 2), max(edge - reach, edge // 2)) for edge in free.shape)
    within = squared[inner] <= (cap / resolution) ** 2 * (1 + 1e-9)
    is_equal = np.array_equal(ours[inner][within], squared[inner][within]) and (ours[inner][~within] == 32766).all()
    equal = f"equal to voxtile's in {within.size / 1e6:.1f} M voxels" if is_equal else "**differs from voxtile's**"
    for peer, seconds, note in (
        (f"`edt` {version('edt')}", edt_s, f"no cap; {equal}"),
        (f"`scipy` {scipy.__version__}", scipy_s, "no cap"),
    ):
        speed = millions / seconds
        print(f"| `{name}` | {peer}, the same box | {resolution} | none | {millions:.1f} | {seconds:.2f} | {speed:.1f} | {note} |")
    return 0 if is_equal else 1


if __name__ == "__main__":
    sys.exit(main())
