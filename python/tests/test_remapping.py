"""Replays of the scans that a map keeps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import voxtile


def scans(count: int) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    random = np.random.default_rng(3)
    made = []
    for number in range(count):
        points = random.normal(size=(200, 3)).astype(np.float32) * 3
        pose = np.eye(4)
        pose[:3, 3] = [4.0 * number, 0.3, 0.1]
        made.append((points, pose, random.uniform(0, 200, 200).astype(np.float32)))
    return made


def mapped(path: Path, made: list[tuple[np.ndarray, np.ndarray, np.ndarray]], **how: object) -> str:
    with voxtile.Map.create(path, resolution=0.2, max_range=5.0, **how) as map:  # type: ignore[arg-type]
        map.insert_many(made)
    return voxtile.digest(path)


def test_new_poses_make_the_map_of_a_build_with_them(tmp_path: Path) -> None:
    made = scans(6)
    before = mapped(tmp_path / "kept", made, keep_scans=True)
    for kept, taken in zip(voxtile.scans(tmp_path / "kept"), made, strict=True):
        assert all(np.array_equal(a, b) for a, b in zip(kept, taken, strict=True))
    moved = [(points, pose + np.eye(4, k=3) * 0.1 * number, of) for number, (points, pose, of) in enumerate(made)]
    wanted = mapped(tmp_path / "wanted", moved)
    poses = np.array([pose for _, pose, _ in moved])
    dry = voxtile.remap(tmp_path / "kept", poses, dry_run=True)
    assert dry["scans_changed"] == 5 and dry["estimated_s"] > 0
    assert voxtile.digest(tmp_path / "kept") == before
    seen = []
    voxtile.remap(tmp_path / "kept", poses, keep_as="before", progress=lambda done, all: seen.append((done, all)))
    assert voxtile.digest(tmp_path / "kept") == wanted and seen[-1] == (6, 6)
    assert voxtile.digest(tmp_path / "kept", snapshot="before") == before
    report = voxtile.remap(tmp_path / "kept", {1: made[0][1], 6: made[5][1]}, tolerance=(1.0, 1.0))
    assert (report["scans_changed"], report["scans_within_tolerance"]) == (0, 1)


def test_scans_and_points_are_removed(tmp_path: Path) -> None:
    made = scans(5)
    mapped(tmp_path / "kept", made, keep_scans=True)
    report = voxtile.remove_scans(tmp_path / "kept", scans=(2, 3))
    assert report["scans_removed"] == 2
    assert voxtile.digest(tmp_path / "kept") == mapped(tmp_path / "left", [made[0], *made[3:]])
    region = [[-9, -9, -9], [2, 9, 9]]
    gone = voxtile.remove_points(tmp_path / "kept", region)
    assert gone["points_removed"] > 100
    voxtile.remap_as(tmp_path / "kept", tmp_path / "coarse", resolution=0.4, tile_size=8.0)
    with voxtile.open(tmp_path / "coarse") as coarse:
        assert coarse.resolution == 0.4 and len(coarse.occupied()[0]) > 0


def test_a_removal_reports_snapshots_that_may_contain_the_scans(tmp_path: Path) -> None:
    made = scans(4)
    mapped(tmp_path / "kept", made, keep_scans=True)
    for name in ["good", "bad"]:
        voxtile.snapshot(tmp_path / "kept", name)
    (tmp_path / "kept" / "snapshots" / "bad").write_bytes(b"nothing")
    with pytest.raises(voxtile.errors.SnapshotsFailedError, match="may still contain removed scans: bad") as raised:
        voxtile.remove_scans(tmp_path / "kept", scans=(2, 3), from_snapshots=True)
    report = raised.value.report
    assert report is not None and raised.value.kind == "snapshots_failed"
    assert (report["scans_removed"], report["snapshots_deleted"]) == (2, ["good"])
    assert voxtile.digest(tmp_path / "kept") == mapped(tmp_path / "left", [made[0], made[3]])


def test_invalid_replays_are_errors(tmp_path: Path) -> None:
    made = scans(2)
    mapped(tmp_path / "without", made)
    with pytest.raises(voxtile.VoxtileError, match="keeps no scans"):
        voxtile.remap(tmp_path / "without", [made[0][1], made[1][1]])
    mapped(tmp_path / "kept", made, keep_scans=True)
    with pytest.raises(voxtile.VoxtileError, match="1 poses for 2 scans"):
        voxtile.remap(tmp_path / "kept", [made[0][1]])
    with pytest.raises(voxtile.VoxtileError, match="exactly one of"):
        voxtile.remove_scans(tmp_path / "kept")
    with pytest.raises((voxtile.VoxtileError, ValueError, TypeError)):
        voxtile.remap(tmp_path / "kept", [np.full((4, 4), np.nan)] * 2)
    with pytest.raises(voxtile.VoxtileError):
        list(voxtile.scans(tmp_path / "without"))


def wall_with_passer_by(number: int) -> np.ndarray:
    """Returns the points of a wall; in the third scan something is before it."""
    y, z = np.meshgrid(np.linspace(-2, 2, 81), np.linspace(-2, 2, 81))
    points = np.stack([np.full_like(y, 5.05), y, z], axis=-1).reshape(-1, 3)
    is_before = (np.abs(points[:, 1:]).max(axis=1) < 0.8) & (number == 2)
    points[is_before] *= 0.5
    return points


def test_what_moved_is_marked_and_unmarked(tmp_path: Path) -> None:
    path = tmp_path / "map"
    with voxtile.Map.create(path, resolution=0.2, keep_scans=True, clearing="guarded") as drive:
        for number in range(6):
            drive.insert(wall_with_passer_by(number), pose=([0, 0, 0], [0, 0, 0, 1]))
    before = voxtile.digest(path)
    report = voxtile.clean(path, memory="256MiB")
    assert report["scans_changed"] == 1 and report["points"] == 6 * 81 * 81
    assert voxtile.digest(path) != before
    scans = voxtile.scans(path)
    assert scans.moving is None
    counts = []
    for points, _, _ in scans:
        moving = scans.moving
        counts.append(0 if moving is None else int(moving.sum()))
        assert moving is None or (moving.dtype == bool and moving.shape == points.shape[:1])
        assert moving is None or np.all(points[moving, 0] < 3)
    assert counts == [0, 0, report["points_changed"], 0, 0, 0]
    exported = voxtile.export_scans(path, tmp_path / "moving", only_moving=True)
    assert exported["scans"] == 1 and exported["points"] == report["points_changed"]
    assert voxtile.clean(path, region=[[-9, -9, -9], [0, 9, 9]])["points_changed"] == 0
    assert voxtile.clean(path, parked_scans=1)["points_changed"] == 0
    assert voxtile.clean(path, undo=True)["points_changed"] == 0
    assert voxtile.digest(path) == before
    with pytest.raises(voxtile.VoxtileError, match="undo"):
        voxtile.clean(path, undo=True, parked_scans=3)
