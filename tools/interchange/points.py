#!/usr/bin/env python3
"""Prints the points of a file as read by a Python library: `x y z`, after `# origin X Y Z` if the library returns it.

    points.py plyfile|pypcd4|open3d FILE
"""
import sys


def points_of(library, path):
    if library == "plyfile":
        import plyfile

        vertices = plyfile.PlyData.read(path)["vertex"]
        return None, zip(vertices["x"].tolist(), vertices["y"].tolist(), vertices["z"].tolist())
    if library == "pypcd4":
        import pypcd4

        cloud = pypcd4.PointCloud.from_path(path)
        return cloud.metadata.viewpoint[:3], cloud.numpy(("x", "y", "z")).tolist()
    if library == "open3d":
        import numpy
        import open3d

        return None, numpy.asarray(open3d.io.read_point_cloud(path).points).tolist()
    sys.exit(f"{library} is not one of plyfile, pypcd4, open3d")


def main():
    origin, points = points_of(sys.argv[1], sys.argv[2])
    if origin is not None:
        print("# origin", *(repr(float(x)) for x in origin))
    for point in points:
        print(*(repr(float(x)) for x in point))


if __name__ == "__main__":
    main()
