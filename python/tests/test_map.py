"""Inserts and queries of an open map."""

import subprocess
import sys
import textwrap
import time
from pathlib import Path

import numpy as np
import pytest
import voxtile
from conftest import NaiveMap, Scan, matrix_of, scans_of
from voxtile import errors


def made(folder: Path, scans: list[Scan], **options: object) -> voxtile.Map:
    made = voxtile.Map.create(folder, 0.25, tile_size=4.0, **options)  # type: ignore[arg-type]
    for points, pose in scans:
        made.insert(points, pose)
    return made


def test_a_background_flush_has_the_state_of_its_call(tmp_path: Path) -> None:
    scans = scans_of(6, count=12, points=2000)
    with voxtile.Map.create(tmp_path / "map", 0.1) as found:
        found.insert_many(scans[:6])
        found.flush(wait=False)
        found.insert_many(scans[6:])
        until = time.monotonic() + 60
        while found.flushed_scan_number != 6:
            assert time.monotonic() < until
            time.sleep(0.01)
        with voxtile.open(tmp_path / "map") as seen, voxtile.Map.create(tmp_path / "half", 0.1) as half:
            half.insert_many(scans[:6])
            assert (seen.scan_number, seen.flushed_scan_number) == (6, 6) and seen.digest() == half.digest()
    with voxtile.Map.create(tmp_path / "whole", 0.1) as whole:
        whole.insert_many(scans)
        assert whole.digest() == voxtile.digest(tmp_path / "map")


@pytest.mark.parametrize("seed", range(3))
def test_equals_the_naive_map(tmp_path: Path, seed: int) -> None:
    scans, naive = scans_of(seed), NaiveMap(0.25)
    with voxtile.Map.create(tmp_path / "map", 0.25, tile_size=4.0) as found:
        for points, pose in scans:
            world = points.astype(np.float64) @ matrix_of(pose)[:3, :3].T + pose[:3]
            naive.insert(world, pose[:3])
            report = found.insert(world, origin=pose[:3])
            assert (report.points, report.skipped) == (len(points), 0)
        keys = np.array(sorted(naive.voxels))
        around = np.concatenate([keys, keys + 7, np.random.default_rng(seed).integers(-30, 30, (500, 3))])
        centers = (around + 0.5) * 0.25
        expected = [naive.voxels.get(tuple(key), [np.nan, 0]) for key in around.tolist()]
        log_odds = np.array([value for value, _ in expected])
        assert np.array_equal(found.counts(centers), [count for _, count in expected])
        # OctoMap's log-odds are single-precision numbers.
        np.testing.assert_allclose(found.log_odds(centers), log_odds, atol=1e-5)
        np.testing.assert_allclose(found.probability(centers), 1 / (1 + np.exp(-log_odds)), atol=1e-5)
        unknown = np.isnan(log_odds)
        assert np.array_equal(found.occupancy(centers), np.where(unknown, -1, log_odds >= 0))
        occupied = {key for key, (value, _) in naive.voxels.items() if value >= 0}
        places, probabilities = found.occupied()
        assert {tuple(key) for key in np.floor(places / 0.25).astype(int).tolist()} == occupied
        assert len(places) == len(occupied) and probabilities.dtype == np.float32
        by_tile = [(centers, found) for _, centers, found in found.occupied_by_tile()]
        assert np.array_equal(np.concatenate([centers for centers, _ in by_tile]), places)
        dense, corner = found.to_dense([[-5, -5, -2], [5, 5, 2]])
        assert dense.shape == (40, 40, 16) and np.array_equal(corner, [-5, -5, -2])
        at = np.stack(np.meshgrid(*(np.arange(n) for n in dense.shape), indexing="ij"), -1).reshape(-1, 3)
        assert np.array_equal(dense.reshape(-1), found.occupancy((at + 0.5) * 0.25 + corner))


def test_all_array_types_make_the_same_map(tmp_path: Path, room: list[Scan]) -> None:
    digests = set()
    forms = {
        "single": lambda points: points,
        "strided": lambda points: np.repeat(points, 2, axis=0)[::2],
        "columns": lambda points: np.asfortranarray(points),
        "reversed": lambda points: points[::-1][::-1],
        "wide": lambda points: points.astype(np.float64),
        "swapped": lambda points: points.astype(">f4"),
        "unaligned": lambda points: np.frombuffer(b"x" + points.tobytes(), np.float32, offset=1).reshape(-1, 3),
        "list": lambda points: points.astype(np.float64).tolist(),
    }
    for name, form in forms.items():
        with voxtile.Map.create(tmp_path / name, 0.25) as found:
            for points, pose in room:
                found.insert(form(points), pose)
            digests.add(found.digest())
    assert len(digests) == 1


def test_poses(tmp_path: Path, room: list[Scan]) -> None:
    def digest(name: str, scans: list[Scan]) -> str:
        with made(tmp_path / name, scans) as found:
            return found.digest()

    # Half of a right angle is exact in all forms of a pose.
    poses = [np.array([1.0, 2.0, 0.5, 0.0, 0.0, 0.0, 1.0])] * len(room)
    seven = [(points, pose) for (points, _), pose in zip(room, poses)]
    pairs = [(points, (pose[:3], pose[3:])) for points, pose in seven]
    matrices = [(points, matrix_of(pose)) for points, pose in seven]
    assert digest("seven", seven) == digest("pairs", pairs) == digest("matrices", matrices)  # type: ignore[arg-type]


def test_skipped_points_are_counted(tmp_path: Path) -> None:
    points = np.array([[1, 2, 3], [np.nan, 0, 0], [4, 4, 4], [0, 0, 0]], np.float32)
    masked = np.ma.masked_array(points, [[False] * 3, [False] * 3, [True] * 3, [False] * 3])
    with voxtile.Map.create(tmp_path / "map", 0.25) as found:
        report = found.insert(masked, np.eye(4))
        assert (report.points, report.not_finite, report.no_return, report.skipped) == (4, 2, 1, 3)
        whole = np.ma.masked_array([[1, 2, 3], [4, 5, 6]], [[True] * 3, [False] * 3])
        assert found.insert(whole, np.eye(4)).not_finite == 1


def test_intensities(tmp_path: Path) -> None:
    with voxtile.Map.create(tmp_path / "map", 0.25, sensor_model="iwlo") as found:
        found.insert([[1, 2, 3.0]], np.eye(4), intensities=[250.0])
        assert found.occupancy([[1.1, 2.1, 3.1]]).tolist() == [1]
        with pytest.raises(errors.ArgumentError, match="intensities"):
            found.insert([[1, 2, 3.0]], np.eye(4))
        with pytest.raises(errors.ArgumentError, match="intensities"):
            found.insert([[1, 2, 3.0]], np.eye(4), intensities=[250.0, 1.0])


def test_rays_nearest_boxes(tmp_path: Path) -> None:
    with voxtile.Map.create(tmp_path / "map", 0.5) as found:
        found.insert([[4.25, 0.25, 0.25]], origin=[0.25, 0.25, 0.25])
        distances, voxels = found.cast_rays([0.25, 0.25, 0.25], [[1, 0, 0], [0, 1, 0]])
        assert distances.tolist() == [3.75, np.inf] and voxels[0].tolist() == [8, 0, 0]
        assert found.cast_rays([[0.25] * 3], [[1, 0, 0]], max_range=2.0)[0].tolist() == [np.inf]
        distances, _ = found.cast_rays([[0.25] * 3], [[0, 1, 0]], unknown="obstacle")
        assert distances.tolist() == [0.25]
        voxels, distances, directions = found.nearest([[2.25, 0.25, 0.25], [99, 0, 0]], 5.0)
        assert voxels[0].tolist() == [8, 0, 0] and distances.tolist() == [2.0, np.inf]
        assert directions[0].tolist() == [1, 0, 0] and np.isnan(directions[1]).all()
        boxes = np.array([[4, 0, 0, 5, 1, 1], [0, 0, 0, 1, 1, 1]], float)
        assert found.collides(boxes).tolist() == [True, False]
        assert found.collides(boxes.reshape(2, 2, 3), unknown="obstacle").tolist() == [True, True]


def test_closed_and_read_only_maps(tmp_path: Path, room: list[Scan]) -> None:
    with made(tmp_path / "map", room) as found:
        digest = found.digest()
        with pytest.raises(errors.LockedError) as locked:
            voxtile.Map.open(tmp_path / "map")
        assert locked.value.path is not None
    assert found.closed and "closed" in repr(found)
    found.close()
    for ask in (
        lambda: found.insert([[1, 2, 3]], np.eye(4)),
        lambda: found.occupancy([[1, 2, 3]]),
        lambda: found.occupied(),
        lambda: found.flush(),
        lambda: found.tiles,
        lambda: found.digest(),
    ):
        with pytest.raises(errors.ClosedError):
            ask()
    with voxtile.open(tmp_path / "map") as read:
        assert read.digest() == digest and not read.writable
        with pytest.raises(errors.ReadOnlyError):
            read.insert([[1, 2, 3]], np.eye(4))
        with voxtile.Map.open(tmp_path / "map") as again:
            again.insert([[1, 2, 3]], np.eye(4))
        assert read.refresh() and not read.refresh()
        assert read.digest() != digest
    with pytest.raises(errors.NoMapError) as missing:
        voxtile.open(tmp_path / "nothing")
    assert missing.value.path == tmp_path / "nothing"
    with pytest.raises(errors.ExistsError):
        voxtile.Map.create(tmp_path / "map")


def test_an_error_does_not_change_the_map(tmp_path: Path, room: list[Scan]) -> None:
    with made(tmp_path / "map", room) as found:
        digest = found.digest()
        for points, pose in (([[1, 2]], np.eye(4)), ([[1, 2, 3]], np.zeros((4, 4))), ("no", np.eye(4))):
            with pytest.raises(errors.ArgumentError):
                found.insert(points, pose)  # type: ignore[arg-type]
        with pytest.raises(errors.ArgumentError):
            found.insert([[1, 2, 3]])
        with pytest.raises(errors.TooLargeError):
            found.to_dense([[-1e6] * 3, [1e6] * 3])
        assert found.digest() == digest


def test_an_array_larger_than_memory_is_an_error(tmp_path: Path, room: list[Scan]) -> None:
    resource = pytest.importorskip("resource")
    made(tmp_path / "map", room).close()
    # In a process of its own, because a failed allocation would end it.
    script = """
        import resource, sys, numpy as np, voxtile
        found = voxtile.Map.open(sys.argv[1], "r")
        pages = int(open("/proc/self/statm").read().split()[0])
        most = pages * resource.getpagesize() + (512 << 20)
        resource.setrlimit(resource.RLIMIT_AS, (most, most))
        for voxels in (500, 1000):
            try:
                found.to_dense([[0, 0, 0], np.full(3, 0.25 * voxels)], "log_odds")
            except voxtile.errors.TooLargeError as error:
                print(error)
        """
    if not Path("/proc/self/statm").exists():
        pytest.skip("no /proc")
    assert resource is not None
    command = [sys.executable, "-c", textwrap.dedent(script), str(tmp_path / "map")]
    printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    assert len(printed) == 2 and "1000000000" in printed[0] and "8000000000" in printed[1], printed


def test_the_viewer_of_a_snapshot_shows_the_snapshot(
    tmp_path: Path, room: list[Scan], monkeypatch: pytest.MonkeyPatch
) -> None:
    shown: list[str] = []
    monkeypatch.setattr("subprocess.Popen", lambda command: shown.append(command[-1]))
    with made(tmp_path / "map", room) as found:
        found.snapshot("before")
        found.view()
    with voxtile.Map.open(tmp_path / "map", "r", snapshot="before") as found:
        found.view()
    assert shown == [str(tmp_path / "map"), f"{tmp_path / 'map'}@before"]


def test_insert_many_ends_at_an_error_of_the_iterable(tmp_path: Path, room: list[Scan]) -> None:
    def failing() -> object:
        yield room[0]
        raise OSError("no more")

    with voxtile.Map.create(tmp_path / "map", 0.25) as found:
        assert found.insert_many(room).points == sum(len(points) for points, _ in room)
        with pytest.raises(OSError, match="no more"):
            found.insert_many(failing())  # type: ignore[arg-type]
        assert found.scan_number == len(room) + 1


def test_fuzz_of_arguments(tmp_path: Path) -> None:
    random = np.random.default_rng(3)
    shapes = [(), (0,), (3,), (0, 3), (5, 3), (3, 5), (2, 2, 3), (4, 4), (6,), (2, 6), (1, 1, 1, 1)]
    dtypes = ["f2", "f4", "f8", ">f8", "i4", "u1", "?", "c16", "O", "S3", "M8[s]"]

    def anything() -> object:
        kind = random.integers(0, 9)
        if kind == 0:
            return [None, "text", b"bytes", {}, [], [[1, 2], [3]], object(), 1e300, -1, 2**70][random.integers(0, 10)]
        array = np.asarray(random.normal(size=shapes[random.integers(len(shapes))]) * 10 ** random.uniform(-3, 3))
        if kind == 1 and array.size:
            array.flat[random.integers(array.size)] = [np.nan, np.inf, -np.inf, 1e308][random.integers(0, 4)]
        with np.errstate(all="ignore"):
            array = np.asarray(np.nan_to_num(array)).astype(dtypes[random.integers(len(dtypes))]) if kind > 2 else array
        array = np.asarray(array)
        return [array, array[::-1] if array.ndim else array, array.T][random.integers(0, 3)]

    with voxtile.Map.create(tmp_path / "map", 0.5, memory="64MiB", max_range=30.0) as found:
        calls = {
            "insert": lambda: found.insert(anything(), anything(), origin=None, intensities=None),
            "insert of the world": lambda: found.insert(anything(), origin=anything(), intensities=anything()),
            "insert_many": lambda: found.insert_many(anything()),
            "occupancy": lambda: found.occupancy(anything()),
            "log_odds": lambda: found.log_odds(anything()),
            "cast_rays": lambda: found.cast_rays(anything(), anything(), max_range=50.0),
            "nearest": lambda: found.nearest(anything(), 2.0),
            "collides": lambda: found.collides(anything()),
            "occupied": lambda: found.occupied(anything(), 0.5),
            "to_dense": lambda: found.to_dense(np.clip(np.real(np.asarray(anything())).astype(float), -20, 20)),
        }
        succeeded = dict.fromkeys(calls, 0)
        for name, call in calls.items():
            for _ in range(300):
                try:
                    call()
                    succeeded[name] += 1
                except (voxtile.VoxtileError, TypeError, ValueError):
                    pass
        assert sum(count > 0 for count in succeeded.values()) >= 8, succeeded
        assert found.digest()
