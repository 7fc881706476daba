"""Compares M3C2 (py4dgeo), alone and with occlusion (OccPy), and `voxtile compare` on simulated epochs.

epochs.py FOLDER VOXTILE            prints a table of the scenes in a folder, which run.sh writes; seconds are CPU time
epochs.py FOLDER SCENE occpy        writes what each epoch has observed by OccPy; run by the former
epochs.py FOLDER SCENE m3c2         prints the changes that M3C2 finds as JSON; run by the former
"""

from __future__ import annotations

import json
import pathlib
import resource
import subprocess
import sys
import time
from typing import Any

import numpy as np

VOXEL_M = 0.1
MIN_VOXELS = 8
# Least distance of a change in metres, in addition to the level of detection: five times the noise of a point.
LEAST_M = 0.05
# Box of OccPy's grid: the hall, and half a metre around it.
GRID = [-0.5, -0.5, -0.5, 18.5, 10.5, 4.5]
# Class of OccPy: seen through.
EMPTY = 2
# Space behind the screens of the scene `screens`.
HIDDEN = ([6.0, 7.4, 0.3], [9.0, 9.0, 2.0])


def scans(folder: pathlib.Path) -> list[tuple[np.ndarray, np.ndarray]]:
    """Sensor positions and points of a walk, in the world's frame."""
    found = []
    for line in open(folder / "poses_tum.txt"):
        number, *position = line.split()[:4]
        origin = np.array(position, np.float64)
        content = (folder / f"{int(number):06}.pcd").read_bytes()
        points = np.frombuffer(content.split(b"DATA binary\n", 1)[1], "<f4").reshape(-1, 3)
        found.append((origin, points.astype(np.float64) + origin))
    return found


def peak_bytes() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def occpy(scene: pathlib.Path) -> dict[str, Any]:
    """Writes the voxels of each epoch that OccPy classifies as hit, empty, occluded, unobserved."""
    import laspy
    from occpy.occpy import OccPy

    seconds = 0.0
    for name in ("before", "after"):
        folder = scene / f"{name}.las"
        folder.mkdir(exist_ok=True)
        rows = ["ScanPos,x,y,z"]
        for number, (origin, points) in enumerate(scans(scene / name)):
            las = laspy.create(point_format=6, file_version="1.4")
            las.header.scales, las.header.offsets = [1e-5] * 3, [0.0] * 3
            las.x, las.y, las.z = points.T
            las.return_number = las.number_of_returns = np.ones(len(points), np.uint8)
            las.gps_time = np.arange(len(points), dtype=np.float64)
            las.write(str(folder / f"s{number:03}.las"))
            rows.append(f"s{number:03}," + ",".join(map(str, origin)))
        (scene / f"{name}.csv").write_text("\n".join(rows) + "\n")
        settings = {"laz_in": str(folder), "out_dir": str(scene / f"{name}.occ"), "vox_dim": VOXEL_M, "plot_dim": GRID}
        tracer = OccPy({**settings, "is_mobile": False, "single_return": True})
        path = str(scene / f"{name}.csv")
        tracer.define_sensor_pos(path, delimiter=",", hdr_scanpos_id="ScanPos", hdr_x="x", hdr_y="y", hdr_z="z")
        began = time.process_time()
        tracer.do_raytracing()
        seconds += time.process_time() - began
    return {"seconds": seconds, "peak_bytes": peak_bytes()}


def seen_through(scene: pathlib.Path, name: str, points: np.ndarray) -> np.ndarray:
    """Whether an epoch has seen the voxels of points as empty, by OccPy."""
    classes = np.load(scene / f"{name}.occ" / "Classification.npy")
    voxels = np.floor((points - GRID[:3]) / VOXEL_M + 1e-9).astype(int)
    is_inside = ((voxels >= 0) & (voxels < classes.shape)).all(axis=1)
    found = np.zeros(len(points), bool)
    found[is_inside] = classes[tuple(voxels[is_inside].T)] == EMPTY
    return found


def clusters(points: np.ndarray) -> list[dict[str, Any]]:
    """Boxes of the points whose voxels are connected, as `voxtile compare` clusters voxels."""
    rest = set(map(tuple, np.floor(points / VOXEL_M).astype(int).tolist()))
    around = [(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1)]
    found = []
    while rest:
        near, cluster = [rest.pop()], []
        while near:
            voxel = near.pop()
            cluster.append(voxel)
            joined = {(voxel[0] + x, voxel[1] + y, voxel[2] + z) for x, y, z in around} & rest
            rest -= joined
            near.extend(joined)
        if len(cluster) >= MIN_VOXELS:
            voxels = np.array(cluster)
            low, high = voxels.min(axis=0) * VOXEL_M, (voxels.max(axis=0) + 1) * VOXEL_M
            found.append({"min": low.tolist(), "max": high.tolist()})
    return found


def m3c2(scene: pathlib.Path) -> dict[str, Any]:
    """Changes by M3C2 from each epoch to the other: core points whose distance is significant, and those without a
    counterpart.
    """
    import py4dgeo

    names = ["before", "after"]
    clouds = [np.concatenate([points for _, points in scans(scene / name)]) for name in names]
    epochs = [py4dgeo.Epoch(points) for points in clouds]
    began, changes, moved = time.process_time(), [], None
    for kind, (own, other) in [("vanished", (0, 1)), ("appeared", (1, 0))]:
        _, first = np.unique(np.floor(clouds[own] / VOXEL_M).astype(np.int64), axis=0, return_index=True)
        core = np.ascontiguousarray(clouds[own][np.sort(first)])
        method = py4dgeo.M3C2(
            epochs=(epochs[own], epochs[other]),
            corepoints=core,
            normal_radii=[0.2, 0.3, 0.5],
            cyl_radius=0.1,
            max_distance=1.0,
            registration_error=0.0,
        )
        distances, uncertainties = method.run()
        detectable = uncertainties["lodetection"]
        is_changed = (np.abs(distances) > np.nan_to_num(detectable, nan=np.inf)) & (np.abs(distances) > LEAST_M)
        is_missing = np.isnan(distances)
        is_seen = seen_through(scene, names[other], core)
        for way, chosen in [
            ("distance", is_changed),
            ("missing", is_changed | is_missing),
            ("seen", (is_changed | is_missing) & is_seen),
        ]:
            changes += [{"way": way, "kind": kind, **box} for box in clusters(core[chosen])]
        if scene.name.startswith("panel") and kind == "vanished":
            # The core points on the front of the panel.
            front = (core[:, 0] > 6.1) & (core[:, 0] < 9.9) & (np.abs(core[:, 1] - 8.0) < 0.04) & (core[:, 2] < 2.4)
            significant = np.abs(distances[front]) > detectable[front]
            moved = [float(np.nanmedian(np.abs(distances[front]))), float(significant.mean())]
    seconds = time.process_time() - began
    points = [len(points) for points in clouds]
    return {"seconds": seconds, "peak_bytes": peak_bytes(), "changes": changes, "moved": moved, "points": points}


def timed(command: list[str]) -> tuple[dict[str, Any], float]:
    """Returns the JSON that a command prints, and its CPU time."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    printed = json.loads(subprocess.check_output(command))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return printed, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def voxtile(scene: pathlib.Path, program: str) -> dict[str, Any]:
    """Changes by `voxtile compare`, with the seconds and memory of both builds."""
    seconds, peak = [], []
    for name in ("before", "after"):
        command = [program, "build", str(scene / name), "-o", str(scene / f"{name}.map"), "--json", "--quiet"]
        command += ["--poses", str(scene / name / "poses_tum.txt"), "--resolution", str(VOXEL_M)]
        built, took = timed([*command, "--clearing", "guarded"])
        peak.append(built["peak_rss_bytes"])
        seconds.append(took)
    command = [program, "compare", str(scene / "before.map"), str(scene / "after.map"), "--json", "--quiet"]
    found, took = timed([*command, "--min-voxels", str(MIN_VOXELS)])
    changes = [{"way": "", "kind": one["kind"], **one["bounds_m"]} for one in found["changes"]]
    return {
        "build_seconds": sum(seconds),
        "build_peak_bytes": max(peak),
        "seconds": took,
        "peak_bytes": found["peak_rss_bytes"],
        "changes": changes,
    }


def touch(a: dict[str, Any], low: np.ndarray, high: np.ndarray) -> bool:
    """Whether a box is within a voxel of another one."""
    return bool((np.array(a["min"]) < high + VOXEL_M).all() and (low < np.array(a["max"]) + VOXEL_M).all())


def score(scene: pathlib.Path, changes: list[dict[str, Any]]) -> tuple[int, int, int, int, int]:
    """Things found, things, changes, false changes, false changes behind the screens."""
    rows = [line.strip().split(",") for line in open(scene / "things.csv")][1:]
    things = [(row[0], np.array(row[1:4], float), np.array(row[4:7], float)) for row in rows if row[0] != "stays"]
    found = sum(any(of["kind"] == kind and touch(of, *box) for of in changes) for kind, *box in things)
    wrong = [of for of in changes if not any(of["kind"] == kind and touch(of, *box) for kind, *box in things)]
    low, high = map(np.array, HIDDEN)
    hidden = [of for of in wrong if scene.name == "screens" and touch(of, low + VOXEL_M, high - VOXEL_M)]
    return found, len(things), len(changes), len(wrong), len(hidden)


def main() -> None:
    folder = pathlib.Path(sys.argv[1])
    if len(sys.argv) > 3:
        step = {"m3c2": m3c2, "occpy": occpy}[sys.argv[3]]
        print("\n" + json.dumps(step(folder / sys.argv[2])))
        return
    print("| scene | method | seconds | peak | things found | changes | false | behind screens |")
    print("|---|---|---|---|---|---|---|---|")
    for scene in sorted(path for path in folder.iterdir() if path.is_dir()):
        own = voxtile(scene, sys.argv[2])

        def run(step: str) -> dict[str, Any]:
            # The libraries print their progress on standard output too.
            command = [sys.executable, __file__, str(folder), scene.name, step]
            printed = subprocess.check_output(command, stderr=subprocess.DEVNULL, text=True)
            result: dict[str, Any] = json.loads(printed.strip().splitlines()[-1])
            return result

        occlusion, other = run("occpy"), run("m3c2")

        def row(name: str, result: dict[str, Any], way: str) -> None:
            changes = [change for change in result["changes"] if change["way"] == way]
            found, things, count, wrong, hidden = score(scene, changes)
            behind = str(hidden) if scene.name == "screens" else ""
            megabytes = result["peak_bytes"] / 1e6
            print(
                f"| {scene.name} | {name} | {result['seconds']:.1f} | {megabytes:.0f} MB | {found} of {things} | "
                f"{count} | {wrong} | {behind} |",
                flush=True,
            )

        row("voxtile", own, "")
        row("M3C2, distances", other, "distance")
        row("M3C2, and points without a counterpart", other, "missing")
        total = occlusion["seconds"] + other["seconds"]
        both = max(occlusion["peak_bytes"], other["peak_bytes"])
        row("the same, seen empty by OccPy", {**other, "seconds": total, "peak_bytes": both}, "seen")
        print(
            f"{scene.name}: {other['points']} points; builds {own['build_seconds']:.1f} s, "
            f"{own['build_peak_bytes'] / 1e6:.0f} MB; displacement {other['moved']}; "
            f"OccPy {occlusion['seconds']:.1f} s",
            file=sys.stderr,
        )


if __name__ == "__main__":
    main()
