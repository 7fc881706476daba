"""Work on whole maps by several processes, column by column: what one process answers."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import voxtile
from conftest import matrix_of, scans_of
from voxtile import errors

distributed = pytest.importorskip("distributed")
voxtile_dask = pytest.importorskip("voxtile.dask")

OPTIONS = {"resolution": 0.25, "tile_size": 2.0, "max_range": 4.0}


@pytest.fixture(scope="module")
def client() -> Iterator[object]:
    cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None)
    with cluster, distributed.Client(cluster) as found:
        yield found


def _map(folder: Path, seed: int, **options: object) -> Path:
    """A map along a street."""
    with voxtile.Map.create(folder, **{**OPTIONS, **options}) as made:
        for number, (points, pose) in enumerate(scans_of(seed, count=10)):
            pose[0] = 0.7 * number - 3.1
            made.insert(points, matrix_of(pose))
    return folder


@pytest.mark.parametrize("region_size", [4.0, 5.3, None])
def test_maps_are_merged_and_fade_as_by_one_process(client: object, region_size: float | None, tmp_path: Path) -> None:
    maps = [_map(tmp_path / name, seed) for seed, name in enumerate(["a", "b", "c"], 1)]
    for prefer in (None, "last"):
        whole, parts = tmp_path / f"whole {prefer}", tmp_path / f"parts {prefer}"
        voxtile.merge(maps, whole, prefer=prefer)
        told = voxtile_dask.merge(maps, parts, prefer=prefer, region_size=region_size, client=client)
        assert voxtile.digest(parts) == voxtile.digest(whole)
        assert (told["regions"] > 1) == (region_size is not None)
    before = voxtile.digest(maps[0])
    voxtile_dask.decay(maps[0], tmp_path / "faded", 5, forget_below=0.1, region_size=region_size, client=client)
    assert voxtile.digest(maps[0]) == before
    voxtile.decay(maps[0], 5, forget_below=0.1)
    assert voxtile.digest(tmp_path / "faded") == voxtile.digest(maps[0]) != before
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {"a", "b", "c", "faded", "whole None", "whole last", "parts None", "parts last"}


def test_maps_that_do_not_go_together_are_refused_and_nothing_is_left(client: object, tmp_path: Path) -> None:
    maps = [_map(tmp_path / "a", 1), _map(tmp_path / "b", 2, probabilities=[0.8, 0.4, 0.1, 0.9])]
    with pytest.raises(errors.VoxtileError, match="prefer"):
        voxtile_dask.merge(maps, tmp_path / "both", client=client)
    with pytest.raises(errors.ArgumentError, match="exists"):
        voxtile_dask.decay(maps[0], maps[1], 5, client=client)
    with pytest.raises(errors.ArgumentError, match="region_size"):
        voxtile_dask.decay(maps[0], tmp_path / "faded", 5, region_size=2.5, client=client)
    assert {path.name for path in tmp_path.iterdir()} == {"a", "b"}


@pytest.mark.parametrize(("format", "options"), [("csv", {"what": "all"}), ("ply", {}), ("bt", {}), ("pcd", {"z_max": 0.5})])
def test_files_of_columns_are_what_one_process_writes_of_them(
    client: object, format: str, options: dict[str, object], tmp_path: Path
) -> None:
    source = _map(tmp_path / "map", 4)
    told = voxtile_dask.export(source, tmp_path / "out", format, region_size=4.0, client=client, **options)
    files = sorted((tmp_path / "out").iterdir())
    assert told["files"] == told["regions"] == len(files) > 3
    for file in files:
        x, y = (int(number) for number in file.stem.split("_"))
        box = [4.0 * x, 4.0 * y, -1e6, 4.0 * (x + 1), 4.0 * (y + 1), 1e6]
        voxtile.export(source, tmp_path / f"one.{format}", region=box, **options)
        assert file.read_bytes() == (tmp_path / f"one.{format}").read_bytes()
    if format == "csv":
        voxtile.export(source, tmp_path / "whole.csv", **options)
        rows = [row for file in files for row in file.read_text().splitlines()[1:]]
        assert sorted(rows) == sorted((tmp_path / "whole.csv").read_text().splitlines()[1:])


def test_damage_is_found_whoever_looks(client: object, tmp_path: Path) -> None:
    source = _map(tmp_path / "map", 5)
    whole = voxtile.verify(source)
    assert voxtile_dask.verify(source, region_size=4.0, client=client) == whole and whole["damage"] == 0
    tables = sorted(source.glob("tile_*/iwlo_meta.bin"))
    for path in [tables[3], sorted(source.glob("tile_*/octree.bt"))[5]]:
        content = bytearray(path.read_bytes())
        content[len(content) // 2] ^= 1
        path.write_bytes(content)
    (source / "tile_77_0_0").mkdir()
    whole, found = voxtile.verify(source), voxtile_dask.verify(source, region_size=4.0, client=client)

    def sorted_findings(told: dict[str, object]) -> list[str]:
        return sorted(json.dumps(finding, sort_keys=True) for finding in told.pop("findings"))

    assert whole["damage"] >= 2 and sorted_findings(found) == sorted_findings(whole) and found == whole
    tables[0].unlink()
    (source / "commits.log").write_bytes(b"nothing")
    assert voxtile_dask.verify(source, client=client)["damage"] > 0
    with pytest.raises(errors.ArgumentError, match="but_tiles"):
        voxtile.verify(source, tiles=[(0, 0, 0)], but_tiles=True)


def test_statistics_count_every_voxel_once(client: object, tmp_path: Path) -> None:
    source = _map(tmp_path / "map", 6)
    told = voxtile_dask.statistics(source, client=client)
    with voxtile.Map.open(source, "r") as opened:
        dense, _ = opened.to_dense(opened.bounds.reshape(-1), "occupancy")
        probability, corner = opened.to_dense(opened.bounds.reshape(-1), "probability")
        centers, _ = opened.occupied()
    assert (told["free"], told["occupied"]) == ((dense == 0).sum(), (dense == 1).sum())
    assert told["occupied"] == len(centers) > 0
    assert np.isclose(told["lowest_occupied"], centers[:, 2].min() - 0.125)
    assert np.isclose(told["highest_occupied"], centers[:, 2].max() + 0.125)
    assert told["probabilities"] == list(np.histogram(probability[dense >= 0], bins=20, range=(0, 1))[0])
    voxtile.clear(source, [-100, -100, -100, 100, 100, 100])
    assert voxtile_dask.statistics(source, client=client)["occupied"] == 0


def test_a_map_is_built_again_from_its_scans_with_other_poses(client: object, tmp_path: Path) -> None:
    source = _map(tmp_path / "map", 7, keep_scans=True)
    poses = []
    for _, pose, _ in voxtile.scans(source):
        pose[1, 3] += 0.9
        poses.append(pose[:3].reshape(-1))
    np.savetxt(tmp_path / "moved.txt", poses, fmt="%.17g")
    voxtile_dask.build(source, tmp_path / "moved", poses=tmp_path / "moved.txt", client=client, region_size=4.0, **OPTIONS)
    before = voxtile.digest(source)
    voxtile.remap(source, [np.vstack([pose.reshape(3, 4), [0, 0, 0, 1]]) for pose in poses])
    assert voxtile.digest(tmp_path / "moved") == voxtile.digest(source) != before


def test_a_plan_has_the_costs_of_what_it_plans() -> None:
    sizes = [100.0, 200.0, 400.0, 800.0, 1600.0]
    plans = [voxtile_dask.simulate(size) for size in sizes]
    for smaller, larger in zip(plans, plans[1:], strict=False):
        assert smaller.tasks > larger.tasks and smaller.overlap > larger.overlap > 1
        assert smaller.bytes_read > larger.bytes_read and smaller.cpu_s > larger.cpu_s
    for plan in plans:
        # Nobody is faster with fewer workers, and all have something to do.
        walls = list(plan.wall_s.values())
        assert walls == sorted(walls, reverse=True) and np.isclose(walls[0], plan.cpu_s)
        assert all(plan.cpu_s / count <= wall <= plan.cpu_s for count, wall in plan.wall_s.items())
        assert abs(plan.scans - 10_000_000) < plan.tasks
    # The advised size is nearly as good as any, for few workers and for many.
    for max_range in (30.0, 60.0, 120.0):
        advised = voxtile_dask.simulate(voxtile_dask.advised_region_size(max_range, 10.0), max_range=max_range)
        others = [voxtile_dask.simulate(size, max_range=max_range) for size in sizes]
        for count, wall in advised.wall_s.items():
            assert wall <= 1.15 * min(other.wall_s[count] for other in others)


def test_the_plan_is_printed() -> None:
    def run(*arguments: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "voxtile.dask.plan", *arguments]
        return subprocess.run(command, capture_output=True, text=True, check=False, env=os.environ)

    table = run("--street-km", "20", "--workers", "1", "2")
    assert table.returncode == 0 and "| 2 workers |" in table.stdout and "advised: 480 m" in table.stdout
    told = json.loads(run("--street-km", "20", "--region-size", "200", "--json").stdout)
    assert [plan["region_size_m"] for plan in told["plans"]] == [200.0]
    assert run("--street-km", "-1").returncode == 2
