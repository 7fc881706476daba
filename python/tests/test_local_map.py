"""The local map: occupied voxels around the robot, and their inflation."""

import numpy as np
import pytest
import voxtile
from conftest import matrix_of, scans_of
from voxtile import errors


def test_hits_are_occupied_and_inflated() -> None:
    scans = scans_of(3, points=2000)
    local = voxtile.LocalMap(0.25, inflation_radius=0.5)
    assert local.position is None and local.updates == 0
    for points, pose in scans:
        report = local.insert(points, pose)
        assert report["points"] == len(points)
    assert local.updates == len(scans) and local.resolution == 0.25
    assert np.allclose(local.position, scans[-1][1][:3])
    occupied, inflated = local.occupied(), local.inflated()
    assert len(occupied) > 100 and len(inflated) > len(occupied)
    assert (local.state(occupied) == 2).all() and (local.state(inflated.astype(np.float32)) == 1).all()
    # Every inflated voxel is within the inflation radius of an occupied one, and all voxels within it are inflated or
    # occupied.
    squared = ((inflated[:, None] - occupied[None]) ** 2).sum(axis=2)
    assert (squared.min(axis=1) <= 0.25 + 1e-9).all()
    around = np.stack(np.meshgrid(*(np.arange(-2, 3),) * 3, indexing="ij"), -1).reshape(-1, 3)
    around = around[(around**2).sum(axis=1) <= 4] * 0.25
    assert (local.state((occupied[:, None] + around).reshape(-1, 3)) > 0).all()
    assert local.state([[100.0, 0, 0]]).tolist() == [0]
    # Hits of the last scan that no ray of it crosses are occupied.
    points, pose = scans[-1]
    world = points @ matrix_of(pose)[:3, :3].T + pose[:3]
    assert (local.state(world) == 2).mean() > 0.5


def test_boxes_collide_with_occupied_and_inflated_voxels() -> None:
    local = voxtile.LocalMap(0.1, inflation_radius=0.3)
    local.insert([[2.05, 0.05, 0.05]], origin=[0, 0, 0])
    boxes = np.array([[1.9, -0.1, -0.1, 2.2, 0.2, 0.2], [1.75, 0.0, 0.0, 1.85, 0.1, 0.1], [0, 0, 0, 1, 1, 1.0]])
    assert local.collides(boxes).tolist() == [True, True, False]
    assert local.collides(boxes.reshape(-1, 2, 3), inflated=False).tolist() == [True, False, False]


@pytest.mark.parametrize(
    "options", [{"preset": "x"}, {"resolution": 0}, {"resolution": float("nan")}, {"inflation_radius": -1.0}]
)
def test_wrong_parameters_are_exceptions(options: dict[str, object]) -> None:
    with pytest.raises(errors.VoxtileError):
        voxtile.LocalMap(**options)  # type: ignore[arg-type]


def test_wrong_scans_are_exceptions() -> None:
    local = voxtile.LocalMap()
    for points in ([[1, 2]], "text", [[[1, 2, 3]]]):
        with pytest.raises((errors.VoxtileError, TypeError, ValueError)):
            local.insert(points, origin=[0, 0, 0])
    with pytest.raises(errors.VoxtileError):
        local.insert([[1, 2, 3]])
    report = local.insert(np.full((4, 3), np.nan), origin=[0, 0, 0])
    assert report["updated"] == 0
