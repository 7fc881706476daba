"""Changes between two maps and frontiers, compared with a brute force in numpy."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import voxtile
from numpy.typing import NDArray
from voxtile import errors

EDGE = 0.25
ROOM = np.array([[0.0, 0.0, 0.0], [6.0, 5.0, 3.0]])
# A voxel of unknown space around all that the scans observe.
REGION = [[-1.0, -1.0, -1.0], [7.0, 6.0, 4.0]]
CUBES = {
    "stays": np.array([[1.0, 3.5, 0.5], [1.5, 4.0, 1.5]]),
    "vanishes": np.array([[4.0, 1.0, 0.75], [4.5, 1.5, 1.75]]),
    "appears": np.array([[2.5, 3.75, 0.75], [3.25, 4.5, 1.75]]),
}
Bits = NDArray[np.bool_]


def entry(boxes: NDArray[np.float64], origin: NDArray[np.float64], ways: NDArray[np.float64]) -> NDArray[np.float64]:
    """Times at which rays enter a box; infinite if they miss it."""
    first, second = (boxes[0] - origin) / ways, (boxes[1] - origin) / ways
    enters, leaves = np.minimum(first, second).max(axis=1), np.maximum(first, second).min(axis=1)
    return np.where((enters < leaves) & (enters > 0), enters, np.inf)


def scan(random: np.random.Generator, origin: NDArray[np.float64], cubes: Sequence[str]) -> NDArray[np.float64]:
    """Points on the walls of the room and on cubes."""
    ways = random.normal(size=(3000, 3))
    walls = np.maximum((ROOM[0] - origin) / ways, (ROOM[1] - origin) / ways).min(axis=1)
    times = np.min([walls, *(entry(CUBES[name], origin, ways) for name in cubes)], axis=0)
    points: NDArray[np.float64] = origin + ways * times[:, None] + random.normal(size=(3000, 3)) * 0.01
    return points


def mapped(path: Path, cubes: Sequence[str], seed: int, scans: int = 8, **options: Any) -> voxtile.Map:
    """Maps the room. Not flushed."""
    random = np.random.default_rng(seed)
    found = voxtile.Map.create(path, EDGE, tile_size=2.0, **options)
    for number in range(scans):
        origin = np.array([0.8 + 0.5 * number, 2.5 + 0.1 * seed, 1.3])
        found.insert(scan(random, origin, cubes), origin=origin)
    return found


@pytest.fixture
def maps(tmp_path: Path) -> tuple[Path, Path]:
    """Two epochs: a cube vanishes, and another one appears."""
    for name, cubes, seed in [("monday", ["stays", "vanishes"], 1), ("tuesday", ["stays", "appears"], 2)]:
        with mapped(tmp_path / name, cubes, seed):
            pass
    return tmp_path / "monday", tmp_path / "tuesday"


def log_odds_of(path: Path | voxtile.Map, region: Any = REGION) -> NDArray[np.float64]:
    if isinstance(path, voxtile.Map):
        return path.to_dense(region, "log_odds")[0]
    with voxtile.open(path) as found:
        return found.to_dense(region, "log_odds")[0]


def moved(bits: Bits, step: Sequence[int]) -> Bits:
    """Moves voxels; none enter at the border."""
    padded = np.pad(bits, 1)
    rolled = np.roll(padded, step, (0, 1, 2))
    return rolled[1:-1, 1:-1, 1:-1]


FACES = [tuple(sign * k for k in axis) for axis in np.eye(3, dtype=int).tolist() for sign in (1, -1)]
AROUND = [(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1)]


def brute_force(before: NDArray[np.float64], after: NDArray[np.float64], certainty: float) -> dict[str, Bits]:
    """The voxels of each class, by the definition, with a tolerance of one voxel."""
    certain = np.log(certainty / (1 - certainty))
    classes: dict[str, Bits] = {}
    for own, other, names in [
        (before, after, ("vanished", "not_seen_after", "uncertain_vanished")),
        (after, before, ("appeared", "not_seen_before", "uncertain_appeared")),
    ]:
        occupied, other_occupied, known = own >= 0, other >= 0, ~np.isnan(other)
        near = np.any([moved(other_occupied, step) for step in AROUND], axis=0)
        surrounded = np.all([moved(known, step) for step in FACES], axis=0)
        rest = occupied & ~near
        changed = rest & (own >= certain) & (other <= -certain) & surrounded
        of_names = (changed, rest & ~known, rest & known & ~changed)
        classes |= dict(zip(names, of_names))
        classes["unchanged"] = occupied & near
    # Without positions of the sensor.
    classes["hidden_before"] = classes["hidden_after"] = np.zeros_like(occupied)
    return classes


def clusters(bits: Bits) -> list[NDArray[np.int64]]:
    """Connected voxels, the largest first, then the one with the lowest voxel by z, y, x."""
    rest = set(map(tuple, np.argwhere(bits).tolist()))
    found = []
    while rest:
        stack = [rest.pop()]
        cluster = []
        while stack:
            voxel = stack.pop()
            cluster.append(voxel)
            near = {(voxel[0] + x, voxel[1] + y, voxel[2] + z) for x, y, z in AROUND} & rest
            rest -= near
            stack.extend(near)
        found.append(np.array(sorted(cluster, key=lambda voxel: voxel[::-1])))
    found.sort(key=lambda cluster: (-len(cluster), cluster[0].tolist()[::-1]))
    return found


def centers_of(voxels: NDArray[np.int64], region: Any = REGION) -> NDArray[np.float64]:
    centers: NDArray[np.float64] = np.asarray(region)[0] + (voxels + 0.5) * EDGE
    return centers


def rows_of(centers: NDArray[np.float64]) -> list[tuple[int, ...]]:
    return sorted(map(tuple, np.floor(centers / EDGE).astype(int).tolist()))


@pytest.mark.parametrize("certainty", [0.6, 0.72, 0.9])
def test_a_comparison_equals_a_brute_force(maps: tuple[Path, Path], certainty: float) -> None:
    counts: list[tuple[int, int]] = []
    found = voxtile.compare(
        *maps, certainty=certainty, min_voxels=3, progress=lambda done, all: counts.append((done, all))
    )
    wanted = brute_force(log_odds_of(maps[0]), log_odds_of(maps[1]), certainty)
    assert counts and counts[-1][0] == counts[-1][1] > 0
    assert list(found.counts) == list(found.CLASSES) and set(found.CLASSES) == set(wanted)
    for name, count in found.counts.items():
        assert count["voxels"] == wanted[name].sum(), name
        assert count["volume_m3"] == pytest.approx(wanted[name].sum() * EDGE**3)
    centers, classes = found.voxels()
    assert centers.dtype == np.float64 and centers.shape == (len(classes), 3) and classes.dtype == np.uint8
    for name, code in found.CLASSES.items():
        assert rows_of(centers[classes == code]) == rows_of(centers_of(np.argwhere(wanted[name]))), name
    expected = [(kind, voxels) for kind in ("vanished", "appeared") for voxels in clusters(wanted[kind])]
    expected = [(kind, voxels) for kind, voxels in expected if len(voxels) >= 3]
    expected.sort(key=lambda change: (-len(change[1]), change[1][0].tolist()[::-1]))
    assert [(change.kind, change.voxels) for change in found.changes] == [(kind, len(of)) for kind, of in expected]
    for change, (kind, voxels) in zip(found.changes, expected):
        centers, classes = found.voxels(change.number)
        assert rows_of(centers) == rows_of(centers_of(voxels)) and set(classes) == {found.CLASSES[kind]}
        assert np.allclose(change.center, centers.mean(axis=0))
        assert np.allclose(change.bounds, [centers.min(axis=0) - EDGE / 2, centers.max(axis=0) + EDGE / 2])
        assert change.volume_m3 == pytest.approx(len(voxels) * EDGE**3)
        assert (change.colour, change.class_, change.first_ns, change.last_ns) == (None, None, None, None)
    if certainty < 0.9:
        # The largest changes are the cubes.
        for kind, name in [("vanished", "vanishes"), ("appeared", "appears")]:
            largest = next(change for change in found.changes if change.kind == kind)
            low, high = CUBES[name]
            assert (largest.bounds[0] < high).all() and (largest.bounds[1] > low).all(), kind


def test_hidden_voxels_need_positions_of_the_sensor(maps: tuple[Path, Path], tmp_path: Path) -> None:
    wanted = brute_force(log_odds_of(maps[0]), log_odds_of(maps[1]), 0.7)
    everywhere = np.mgrid[0.5:6:0.5, 0.5:5:0.5, 0.5:3:0.5].reshape(3, -1).T
    for positions in [(everywhere, [[3.0, 2.0, 1.3]]), ([[900.0, 0.0, 0.0]], np.empty((0, 3)))]:
        found = voxtile.compare(*maps, positions=positions)
        centers, classes = found.voxels()
        for epoch, of_epoch in [("before", found.to_dict()["after"]), ("after", found.to_dict()["before"])]:
            names = [f"not_seen_{epoch}", f"hidden_{epoch}"]
            is_of = np.isin(classes, [found.CLASSES[name] for name in names])
            assert rows_of(centers[is_of]) == rows_of(centers_of(np.argwhere(wanted[names[0]])))
            assert of_epoch["hidden"] == found.counts[names[1]]["voxels"]
    assert found.to_dict()["before"]["hidden"] == found.to_dict()["after"]["hidden"] == 0
    # A wall in front of another one.
    across = np.arange(-4, 5) * EDGE
    for name, x in [("far", 4.1), ("near", 2.1)]:
        with voxtile.Map.create(tmp_path / name, EDGE) as wall:
            y, z = (np.repeat(across, 9) * x / 4.1, np.tile(across, 9) * x / 4.1)
            wall.insert(np.stack([np.full(81, x), y, z], 1), origin=[0.0, 0.0, 0.0])
    behind = voxtile.compare(tmp_path / "far", tmp_path / "near", positions=(None, [[0.0, 0.0, 0.0]])).to_dict()
    assert behind["before"]["hidden"] == behind["before"]["not_seen"] > 50 and behind["after"]["hidden"] is None
    # Those of kept scans.
    for name, cubes, seed in [("one", ["stays"], 1), ("two", ["stays", "appears"], 2)]:
        mapped(tmp_path / name, cubes, seed, keep_scans=True).close()
    own = voxtile.compare(tmp_path / "one", tmp_path / "two")
    positions = [[[0.8 + 0.5 * number, 2.5 + 0.1 * seed, 1.3] for number in range(8)] for seed in (1, 2)]
    assert own.to_dict() == voxtile.compare(tmp_path / "one", tmp_path / "two", positions=tuple(positions)).to_dict()
    assert own.to_dict()["before"]["hidden"] is not None
    with pytest.raises(errors.ArgumentError, match="positions: must be an array of N x 3"):
        voxtile.compare(*maps, positions=([1.0, 2.0], None))


def test_a_region_and_a_tolerance(maps: tuple[Path, Path]) -> None:
    low, high = CUBES["vanishes"]
    found = voxtile.compare(*maps, region=[low - 0.5, high + 0.5], memory="64MiB")
    assert {change.kind for change in found.changes} == {"vanished"}
    centers, _ = voxtile.compare(*maps).voxels()
    is_inside = ((centers >= low - 0.5) & (centers < high + 0.5)).all(axis=1)
    assert rows_of(found.voxels()[0]) == rows_of(centers[is_inside]) != []
    exact = voxtile.compare(*maps, tolerance=0.0).counts
    assert exact["vanished"]["voxels"] > voxtile.compare(*maps, tolerance=0.5).counts["vanished"]["voxels"]
    assert found.resolution == EDGE


def test_open_maps_snapshots_and_octomap_files(maps: tuple[Path, Path], tmp_path: Path) -> None:
    monday, tuesday = maps
    wanted = voxtile.compare(monday, tuesday).to_dict()
    voxtile.snapshot(tuesday, "kept")
    with voxtile.open(monday) as before, voxtile.Map.open(tuesday) as after:
        assert voxtile.compare(before, after).to_dict() == wanted
        # Scans count before they are flushed.
        random, origin = np.random.default_rng(3), np.array([3.0, 2.0, 1.0])
        for _ in range(4):
            after.insert(scan(random, origin, ["stays"]), origin=origin)
        found = voxtile.compare(before, after)
        assert found.to_dict()["after"] != wanted["after"]
        expected = brute_force(log_odds_of(before), log_odds_of(after), 0.7)
        assert found.counts["vanished"]["voxels"] == expected["vanished"].sum()
        assert len(found.voxels()[0]) == sum(count["voxels"] for count in found.counts.values())
        after.insert(scan(random, origin, ["stays"]), origin=origin)
        with pytest.raises(errors.ChangedError, match="compare the maps again"):
            found.voxels()
        same = voxtile.compare(after, after, tolerance=0.0)
        assert not same.changes and same.counts["unchanged"]["voxels"] == (log_odds_of(after) >= 0).sum()
        states = voxtile.compare((tuesday, "kept"), after).warnings
        assert any("states of one map" in warning and "tuesday@kept" in warning for warning in states)
    for found in [voxtile.compare(monday, (str(tuesday), "kept")), voxtile.compare(monday, f"{tuesday}@kept")]:
        assert {**found.to_dict(), "warnings": None} == {**wanted, "warnings": None}
    # `.bt` keeps only occupied and free, with the same clamped log-odds.
    voxtile.export(monday, tmp_path / "monday.bt")
    of_file = voxtile.compare(tmp_path / "monday.bt", f"{tuesday}@kept")
    assert of_file.to_dict()["after"]["occupied"] == wanted["after"]["occupied"]
    assert of_file.counts["vanished"]["voxels"] >= found.counts["vanished"]["voxels"] > 0
    with voxtile.open(tmp_path / "monday.bt") as octree:
        assert voxtile.compare(octree, f"{tuesday}@kept").counts == of_file.counts


def test_results_as_json_as_geojson_and_in_notebooks(maps: tuple[Path, Path], tmp_path: Path) -> None:
    found = voxtile.compare(*maps)
    command = [sys.executable, "-m", "voxtile", "compare", *map(str, maps), "--json", "--list", "changes.geojson"]
    printed = json.loads(subprocess.run(command, cwd=tmp_path, capture_output=True, check=True).stdout)
    assert found.to_dict().items() <= printed.items()
    assert found.to_geojson() == json.loads((tmp_path / "changes.geojson").read_text())
    assert len(found.to_geojson()["features"]) == len(found.changes) > 1
    assert sum("clearing" in warning for warning in found.warnings) == 2
    shown = found._repr_html_()
    assert "uncertain vanished" in shown and "appeared" in shown and "clearing guarded" in shown
    assert f"{len(found.changes)} changes" in repr(found) and "voxels" in repr(found.changes[0])


def test_changes_have_the_layers_of_their_points(tmp_path: Path) -> None:
    for name, cubes, color in [("before", ["vanishes"], [250, 20, 20]), ("after", [], [20, 20, 250])]:
        random, origin = np.random.default_rng(5), np.array([2.0, 2.0, 1.3])
        with voxtile.Map.create(tmp_path / name, EDGE, layers="colour,class") as found:
            for _ in range(8):
                points = scan(random, origin, cubes)
                colors = np.broadcast_to(color, points.shape)
                found.insert(points, origin=origin, colours=colors, classes=np.full(len(points), 20))
    change = voxtile.compare(tmp_path / "before", tmp_path / "after").changes[0]
    assert (change.kind, change.colour, change.class_, change.first_ns) == ("vanished", (250, 20, 20), 20, None)


def test_wrong_arguments(maps: tuple[Path, Path], tmp_path: Path) -> None:
    for options, message in [
        ({"certainty": 0.5}, "certainty"),
        ({"tolerance": -1.0}, "tolerance"),
        ({"region": [[1, 1, 1], [0, 0, 0]]}, "region"),
    ]:
        with pytest.raises(errors.ArgumentError, match=message):
            voxtile.compare(*maps, **options)  # type: ignore[arg-type]
    voxtile.Map.create(tmp_path / "coarse", 0.5).close()
    with pytest.raises(errors.ArgumentError, match="0.25 m and 0.5 m"):
        voxtile.compare(maps[0], tmp_path / "coarse")
    with pytest.raises(errors.NoMapError):
        voxtile.compare(maps[0], tmp_path / "nothing")
    with pytest.raises(TypeError):
        voxtile.compare(maps[0], 7)  # type: ignore[arg-type]
    found = voxtile.compare(*maps)
    with pytest.raises(errors.ArgumentError, match="change: 99 "):
        found.voxels(99)
    closed = voxtile.open(maps[0])
    closed.close()
    with pytest.raises(errors.ClosedError):
        voxtile.compare(closed, maps[1])


def test_a_callback_that_raises_and_ctrl_c_end_a_comparison(maps: tuple[Path, Path]) -> None:
    def refuse(done: int, all: int) -> None:
        raise LookupError("enough")

    with pytest.raises(LookupError, match="enough"):
        voxtile.compare(*maps, progress=refuse)
    script = """if True:
        import signal, sys, threading, time
        import voxtile
        signal.signal(signal.SIGINT, signal.default_int_handler)
        begun = threading.Event()
        main = threading.main_thread().ident

        def interrupt(done, all):
            if not begun.is_set():
                begun.set()
                signal.pthread_kill(main, signal.SIGINT)
                time.sleep(0.3)

        try:
            voxtile.compare(*sys.argv[1:], progress=interrupt)
            print("finished")
        except KeyboardInterrupt:
            print("interrupted", begun.is_set())
        """
    done = subprocess.run([sys.executable, "-c", script, *map(str, maps)], capture_output=True, text=True, check=True)
    assert done.stdout == "interrupted True\n"


def test_other_threads_run_during_a_comparison(maps: tuple[Path, Path]) -> None:
    done = threading.Event()
    other = threading.Thread(target=done.set)

    def run_other(_: int, all: int) -> None:
        # The main thread waits in `compare`, without the interpreter's lock.
        if not done.is_set():
            other.start()
            assert done.wait(10)

    voxtile.compare(*maps, progress=run_other)
    assert done.is_set()


def frontiers_by_force(log_odds: NDArray[np.float64], inside: Bits) -> list[tuple[NDArray[np.int64], int]]:
    """Clusters of the free voxels that are inside, and the numbers of their faces."""
    known = ~np.isnan(log_odds)
    faces = np.sum([~moved(known, step) for step in FACES], axis=0)
    at_frontier = (log_odds < 0) & inside & (faces > 0)
    return [(voxels, int(faces[tuple(voxels.T)].sum())) for voxels in clusters(at_frontier)]


@pytest.mark.parametrize("region", [None, [[0.5, 0.5, 0.5], [4.0, 4.0, 1.5]], [[1.9, 1.9, -0.5], [2.2, 6.0, 9.0]]])
def test_frontiers_equal_a_brute_force(tmp_path: Path, region: list[list[float]] | None) -> None:
    with mapped(tmp_path / "map", ["stays", "vanishes"], 1, scans=1) as found:
        # With scans that are not flushed, then of the map on disk.
        for source in ("writer", "reader"):
            frontiers = found.frontiers(region, min_voxels=2)
            log_odds = log_odds_of(found)
            grid = np.stack(np.meshgrid(*map(np.arange, log_odds.shape), indexing="ij"), -1)
            low, high = REGION if region is None else region
            inside: Bits = np.all((centers_of(grid) >= low) & (centers_of(grid) < high), axis=-1)
            wanted = [(voxels, faces) for voxels, faces in frontiers_by_force(log_odds, inside) if len(voxels) >= 2]
            assert [frontier.voxels for frontier in frontiers] == [len(voxels) for voxels, _ in wanted] != []
            for frontier, (voxels, faces) in zip(frontiers, wanted):
                centers = centers_of(voxels)
                assert frontier.area_m2 == pytest.approx(faces * EDGE**2)
                assert np.allclose(frontier.center, centers.mean(axis=0))
                assert np.allclose(frontier.bounds, [centers.min(axis=0) - EDGE / 2, centers.max(axis=0) + EDGE / 2])
                distances = np.linalg.norm(centers - centers.mean(axis=0), axis=1)
                at_goal = np.linalg.norm(centers - frontier.goal, axis=1)
                assert at_goal.min() < 1e-9 and distances[at_goal.argmin()] == pytest.approx(distances.min())
                assert found.occupancy([frontier.goal])[0] == 0
            areas = [frontier.area_m2 for frontier in frontiers]
            large = found.frontiers(region, min_area=1.0, min_voxels=2)
            assert [frontier.area_m2 for frontier in large] == [area for area in areas if area >= 1.0]
            assert f"{areas[0]:.2f} m2" in repr(frontiers[0])
            if source == "writer":
                found.close()
                found = voxtile.open(tmp_path / "map")
        found.close()


def test_an_empty_map_has_no_frontiers(tmp_path: Path) -> None:
    with voxtile.Map.create(tmp_path / "map") as found:
        assert found.frontiers() == []
        with pytest.raises(errors.ArgumentError, match="region"):
            found.frontiers([0, 0, 0])
