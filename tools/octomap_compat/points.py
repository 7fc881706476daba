#!/usr/bin/env python3
"""Writes the scans of a data folder (scans/*.pcd, poses_tum.txt) as a stream of world points.

    points.py FOLDER [MAX_SCANS] > STREAM

Per scan, little-endian: count u32, origin 3 x f32, points 3 x f32 each. The points are rounded to f32, the
only type that OctoMap supports, so that both map the same points. Needs only Python, without numpy.
"""
import math
import pathlib
import struct
import sys
from array import array


def points_of(path):
    """Yields the finite points of a binary PCD, except (0, 0, 0), which means "no return"."""
    data = path.read_bytes()
    header, at = {}, 0
    while header.get("DATA") is None:
        end = data.index(b"\n", at)
        key, *values = data[at:end].decode("ascii").split() or [""]
        header[key], at = values, end + 1
    if header["DATA"] != ["binary"]:
        sys.exit(f"{path}: only binary PCD is supported")
    kinds = {("F", "4"): "f", ("F", "8"): "d", ("U", "1"): "B", ("U", "2"): "H", ("U", "4"): "I"}
    counts = header.get("COUNT", ["1"] * len(header["FIELDS"]))
    kinds = [c + kinds[kind] for kind, c in zip(zip(header["TYPE"], header["SIZE"]), counts)]
    if counts != ["1"] * len(counts) or header["FIELDS"][:3] != ["x", "y", "z"]:
        sys.exit(f"{path}: the fields must begin with x y z and hold one value each")
    record = struct.Struct("<" + "".join(kinds))
    data = data[at : at + int(header["POINTS"][0]) * record.size]
    for x, y, z, *_ in record.iter_unpack(data):
        if math.isfinite(x + y + z) and (x or y or z):
            yield x, y, z


def rotation(qx, qy, qz, qw):
    """The rows of the rotation matrix of a quaternion."""
    norm = math.sqrt(qx * qx + qy * qy + qz * qz + qw * qw)
    x, y, z, w = qx / norm, qy / norm, qz / norm, qw / norm
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )


def main():
    folder = pathlib.Path(sys.argv[1])
    max_scans = int(sys.argv[2]) if len(sys.argv) > 2 else None
    lines = (folder / "poses_tum.txt").read_text().splitlines()
    poses = [[float(word) for word in line.split()] for line in lines if line.strip() and line[0] != "#"]
    scans = sorted((folder / "scans").glob("*.pcd"))
    if len(scans) != len(poses):
        sys.exit(f"{folder}: {len(scans)} scans but {len(poses)} poses")
    for path, (_, tx, ty, tz, *quaternion) in list(zip(scans, poses))[:max_scans]:
        (a, b, c), (d, e, f), (g, h, i) = rotation(*quaternion)
        floats = array("f", (tx, ty, tz))
        for x, y, z in points_of(path):
            floats.extend((a * x + b * y + c * z + tx, d * x + e * y + f * z + ty, g * x + h * y + i * z + tz))
        count = len(floats) // 3 - 1
        if sys.byteorder == "big":
            floats.byteswap()
        sys.stdout.buffer.write(struct.pack("<I", count) + floats.tobytes())


if __name__ == "__main__":
    main()
