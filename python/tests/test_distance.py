"""Distances to the nearest obstacle, compared with a brute force in numpy."""

from pathlib import Path

import numpy as np
import pytest
import voxtile
from conftest import scans_of
from numpy.typing import NDArray
from voxtile import errors

REGION = [[-3.0, -3.0, -1.0], [3.0, 3.0, 2.0]]


def built(path: Path) -> voxtile.Map:
    room = voxtile.Map.create(path, 0.25, max_range=10.0)
    for points, pose in scans_of(5):
        room.insert(points, pose)
    room.flush()
    return room


def brute_force(occupied: NDArray[np.float64], centers: NDArray[np.float64]) -> NDArray[np.float64]:
    distances: NDArray[np.float64] = np.sqrt(((centers[:, None] - occupied[None]) ** 2).sum(axis=2).min(axis=1))
    return distances


def test_fields_in_memory_and_in_folders_equal_a_brute_force(tmp_path: Path) -> None:
    with built(tmp_path / "map") as room:
        occupied, _ = room.occupied()
        field = room.distance_field(REGION, max_distance=1.0, unknown="free")
        marked = room.distance_field(REGION, max_distance=1.0)
        occupancy, _ = room.to_dense(REGION)
    counts: list[tuple[int, int]] = []
    report = voxtile.compute_distances(
        tmp_path / "map",
        tmp_path / "field",
        max_distance=1.0,
        unknown="free",
        memory="64MiB",
        progress=lambda done, all: counts.append((done, all)),
    )
    assert report["tiles_computed"] == report["tiles"] > 0 and report["has_obstacles"] and counts
    again = voxtile.compute_distances(tmp_path / "map", tmp_path / "field", max_distance=1.0, unknown="free")
    assert again["tiles_kept"] == report["tiles"]
    stored = voxtile.DistanceField.open(tmp_path / "field")
    assert (stored.max_distance, stored.unknown, stored.signed, stored.resolution) == (1.0, "free", False, 0.25)
    metres, first = field.to_dense()
    squared, _ = field.to_dense(values="squared_voxels")
    assert metres.shape == (24, 24, 12) and np.allclose(first, [-2.875, -2.875, -0.875])
    centers = first + 0.25 * np.stack(np.meshgrid(*map(np.arange, metres.shape), indexing="ij"), -1).reshape(-1, 3)
    expected = brute_force(occupied, centers)
    beyond = expected > 1.0 + 1e-9
    assert np.allclose(metres.reshape(-1)[~beyond], expected[~beyond], atol=1e-6)
    assert np.isinf(metres.reshape(-1)[beyond]).all() and (squared.reshape(-1)[beyond] == 32766).all()
    assert (squared.reshape(-1)[~beyond] == np.round((expected[~beyond] / 0.25) ** 2)).all()
    assert np.array_equal(stored.to_dense(REGION, values="squared_voxels")[0], squared)
    # At the centers of voxels nothing is interpolated; the border of the field is unknown.
    inside = ((centers > -2.8) & (centers < [2.8, 2.8, 1.8]) & (centers > [-9, -9, -0.8])).all(axis=1)
    assert np.allclose(field.at(centers[inside]), np.minimum(expected[inside], 1.0), atol=1e-9)
    assert np.isnan(field.at([[9.0, 0, 0], [np.nan, 0, 0]])).all()
    points = np.random.default_rng(1).uniform([-2.5, -2.5, -0.5], [2.5, 2.5, 1.5], (500, 3))
    distances, gradients = stored.at_with_gradient(points)
    assert np.array_equal(distances, field.at(points)) and gradients.shape == (500, 3)
    step = np.array([1e-6, 0, 0])
    slopes = (field.at(points + step) - field.at(points - step)) / 2e-6
    near = distances < 0.6
    assert np.abs(slopes[near] - gradients[near, 0]).max() < 1e-3
    # Unknown voxels are unknown by default, and shorten no distance.
    dense, _ = marked.to_dense()
    assert np.array_equal(np.isnan(dense), occupancy == -1)
    assert np.array_equal(dense[occupancy >= 0], metres[occupancy >= 0])


def test_paths_and_signs(tmp_path: Path) -> None:
    with built(tmp_path / "map") as room:
        field = room.distance_field(REGION, max_distance=1.0, unknown="free", signed=True)
        occupied, _ = room.occupied(region=[[-2.5, -2.5, -0.5], [2.5, 2.5, 1.5]])
    assert field.signed and (field.at(occupied) < 0).all()
    assert field.bounds is not None and np.allclose(field.bounds, REGION)
    there = occupied[len(occupied) // 2]
    blocked = field.clearance_along([[0.3, 0.2, 0.5], there], 0.3)
    assert not blocked["clear"] and blocked["blocked"] is not None and blocked["min_distance"] < 0.3
    point = [0.3, 0.2, 0.5]
    free = float(field.at([point])[0])
    assert field.clearance_along([point], free - 0.01) == {"clear": True, "min_distance": free, "blocked": None}
    assert "up to 1 m, signed" in repr(field)


def test_wrong_arguments_are_refused(tmp_path: Path) -> None:
    with built(tmp_path / "map") as room:
        for cap in (0.0, np.nan, 100.0):
            with pytest.raises(errors.ArgumentError, match="from 0.25 m to 45.25 m"):
                room.distance_field(REGION, max_distance=cap)
        with pytest.raises(errors.ArgumentError, match="'unknown', 'free', 'obstacle'"):
            room.distance_field(REGION, unknown="maybe")  # type: ignore[arg-type]
        field = room.distance_field(REGION, max_distance=1.0)
        with pytest.raises(errors.ArgumentError, match="radius"):
            field.clearance_along([[0, 0, 0]], 2.0)
    with pytest.raises(errors.ArgumentError, match="voxtile distance"):
        voxtile.DistanceField.open(tmp_path)
    voxtile.compute_distances(tmp_path / "map", tmp_path / "field", max_distance=1.0)
    with pytest.raises(errors.ArgumentError, match="region"):
        voxtile.DistanceField.open(tmp_path / "field").to_dense()
