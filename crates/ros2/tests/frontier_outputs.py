"""Compares published frontiers with a search in the exported voxels."""

import csv

import numpy as np

# Options of the node in check.sh.
RADIUS_M, HEIGHT_M, MIN_AREA_M2, MIN_VOXELS = 2.0, 1.0, 0.05, 8
ADD, DELETE_ALL, CUBE, SPHERE = 0, 3, 1, 2
FACES = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
AROUND = [(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1)]


def plain_markers(message):
    """Converts markers to numbers and strings."""

    def plain(marker):
        place, scale = marker.pose.position, marker.scale
        numbers = {"at": [place.x, place.y, place.z], "scale": [scale.x, scale.y, scale.z]}
        return {"ns": marker.ns, "id": marker.id, "type": marker.type, "action": marker.action, **numbers}

    return [plain(marker) for marker in message.markers]


def moved(voxel, step):
    return (voxel[0] + step[0], voxel[1] + step[1], voxel[2] + step[2])


def clusters(voxels):
    """Voxels that share faces, edges or corners, the most first, then the lowest by z, y, x."""
    found, rest = [], set(voxels)
    while rest:
        cluster, near = [], [rest.pop()]
        while near:
            voxel = near.pop()
            cluster.append(voxel)
            joined = {moved(voxel, step) for step in AROUND} & rest
            rest -= joined
            near.extend(joined)
        found.append(sorted(cluster, key=lambda voxel: voxel[::-1]))
    return sorted(found, key=lambda cluster: (-len(cluster), cluster[0][::-1]))


def compare_frontiers(got, all_csv, origin, resolution):
    """Returns the number of frontiers, if the messages have those of the exported voxels."""
    free, known = set(), set()
    reach = [RADIUS_M, RADIUS_M, HEIGHT_M]
    for row in csv.DictReader(open(all_csv)):
        center = [float(row[axis]) for axis in "xyz"]
        voxel = tuple(round(at / resolution - 0.5) for at in center)
        known.add(voxel)
        is_inside = all(origin[k] - reach[k] <= center[k] < origin[k] + reach[k] for k in range(3))
        if is_inside and float(row["log_odds"]) < 0:
            free.add(voxel)
    faces = {voxel: sum(moved(voxel, step) not in known for step in FACES) for voxel in free}
    wanted = []
    for cluster in clusters(voxel for voxel in free if faces[voxel]):
        area = sum(faces[voxel] for voxel in cluster) * resolution**2
        if len(cluster) >= MIN_VOXELS and area >= MIN_AREA_M2:
            wanted.append((np.array(cluster), area))
    assert wanted, "the map has no frontiers"
    goals, (first, *markers) = got["frontier_goals"]["points"], got["frontiers"]["markers"]
    assert first["action"] == DELETE_ALL and all(marker["action"] == ADD for marker in markers)
    spheres, cubes = markers[::2], markers[1::2]
    assert len(goals) == len(spheres) == len(cubes) == len(wanted), f"{len(goals)} frontiers, not {len(wanted)}"
    for goal, sphere, cube, (voxels, area) in zip(goals, spheres, cubes, wanted):
        assert (sphere["ns"], sphere["type"], cube["ns"], cube["type"]) == ("goals", SPHERE, "boxes", CUBE)
        assert sphere["at"] == goal and abs(np.pi * sphere["scale"][0] ** 2 / 4 - area) < 1e-6, f"{sphere}: {area} m2"
        centers = (voxels + 0.5) * resolution
        low, high = centers.min(axis=0) - resolution / 2, centers.max(axis=0) + resolution / 2
        assert np.allclose(cube["at"], (low + high) / 2) and np.allclose(cube["scale"], high - low), f"{cube}"
        distances = np.linalg.norm(centers - centers.mean(axis=0), axis=1)
        at_goal = np.linalg.norm(centers - goal, axis=1)
        assert at_goal.min() < 1e-6 and distances[at_goal.argmin()] < distances.min() + 1e-6, f"goal {goal}"
    return len(wanted)
