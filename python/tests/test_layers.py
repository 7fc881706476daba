"""Layers of maps: sums over the points that hit a voxel."""

from pathlib import Path

import numpy as np
import pytest
import voxtile
from voxtile import errors, files


def test_layers_are_sums_over_the_points_of_a_voxel(tmp_path: Path) -> None:
    random = np.random.default_rng(3)
    points = random.uniform(-2.0, 2.0, size=(4000, 3))
    colours = random.integers(0, 256, size=(4000, 3)).astype(np.float64)
    colours[::7] = np.nan
    classes = random.choice([2, 6, -1], size=4000)
    intensities = random.uniform(0, 255, size=4000).astype(np.float32)
    layers = "colour,intensity=255,class,shape"
    with voxtile.Map.create(tmp_path / "map", 0.5, layers=layers) as city:
        assert city.layers == ["colour", "intensity", "class", "shape"]
        for half in (slice(0, 1500), slice(1500, None)):
            city.insert(
                points[half],
                origin=[0.0, 0.0, 0.1],
                intensities=intensities[half],
                colours=colours[half],
                classes=classes[half],
            )
        centers = (np.unique(np.floor(points / 0.5), axis=0) + 0.5) * 0.5
        found = city.layers_at(centers)
        digest = city.layer_digest()
        for number, center in enumerate(centers):
            inside = np.all(np.floor(points / 0.5) == np.floor(center / 0.5), axis=1)
            assert found["points"][number] == inside.sum()
            coloured = inside & ~np.isnan(colours[:, 0])
            if coloured.any():
                assert np.allclose(found["colour"][number], colours[coloured].mean(axis=0))
            else:
                assert np.isnan(found["colour"][number]).all()
            assert abs(found["intensity"][number] - intensities[inside].mean()) < 0.01
            votes = {int(k): int((classes[inside] == k).sum()) for k in (2, 6)}
            best = max(votes.values())
            assert found["class"][number] == (min(k for k in votes if votes[k] == best) if best else -1)
            assert np.allclose(center + found["mean_offset"][number], points[inside].mean(axis=0), atol=1e-3)
            if inside.sum() > 1:
                covariance = np.cov(points[inside].T)
                expected = covariance[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
                # Offsets are stored in steps of a 1024th of a voxel.
                assert np.allclose(found["covariance"][number], expected, atol=1e-3)
        nothing = city.layers_at([[100.0, 0.0, 0.0]])
        assert nothing["points"][0] == 0 and np.isnan(nothing["colour"]).all() and nothing["class"][0] == -1
    with voxtile.open(tmp_path / "map") as again:
        assert again.layers == ["colour", "intensity", "class", "shape"] and again.layer_digest() == digest


def test_wrong_attributes_and_layers_are_refused(tmp_path: Path) -> None:
    with pytest.raises(errors.ArgumentError, match="rgb"):
        voxtile.Map.create(tmp_path / "wrong", layers="rgb")
    with voxtile.Map.create(tmp_path / "map", layers=["colour", "class"]) as city:
        for wrong in (
            {"colours": [[1, 2, 3]]},
            {"colours": [[1, 2, 300]] * 2},
            {"classes": [1, 256]},
            {"classes": [1.5, 2]},
        ):
            with pytest.raises(errors.ArgumentError):
                city.insert([[1.0, 0, 0], [2.0, 0, 0]], origin=[0, 0, 0], **wrong)
        assert city.scan_number == 0
    with voxtile.Map.create(tmp_path / "plain") as plain:
        assert plain.layers == [] and list(plain.layers_at([[0.0, 0, 0]])) == ["points"]


def test_a_build_reads_colours_and_selects_classes(tmp_path: Path) -> None:
    rows = "".join(f"{k} 0 0.5 {10 * k} 0 {k} {k}\n" for k in range(1, 9))
    (tmp_path / "scan.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar class\nend_header\n" + rows
    )
    files.build(tmp_path / "scan.ply", tmp_path / "map", poses="identity", layers="colour,class", skip_class=[7])
    with voxtile.open(tmp_path / "map") as city:
        found = city.layers_at([[3.0, 0.0, 0.5], [7.0, 0.0, 0.5]])
        assert found["colour"][0].tolist() == [30.0, 0.0, 3.0] and found["class"].tolist() == [3, -1]
