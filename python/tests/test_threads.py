"""Threads, signals, memory."""

import os
import pickle
import signal
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import voxtile
from conftest import scans_of


def test_queries_during_inserts(tmp_path: Path) -> None:
    scans = scans_of(1, count=40, points=2000)
    with voxtile.Map.create(tmp_path / "map", 0.1) as found:
        at, numbers, failures = scans[0][0][:500], [], []

        def ask() -> None:
            try:
                while not numbers or numbers[-1] < len(scans):
                    numbers.append(found.scan_number)
                    assert found.occupancy(at).dtype == np.int8
            except BaseException as error:
                failures.append(error)

        reader = threading.Thread(target=ask)
        reader.start()
        for points, pose in scans:
            found.insert(points, pose)
        reader.join(timeout=60)
        assert not failures and not reader.is_alive() and numbers == sorted(numbers)
        digest = found.digest()
    with voxtile.Map.create(tmp_path / "alone", 0.1) as alone:
        alone.insert_many(scans)
        assert alone.digest() == digest


ARRAYS = """
    import os
    import sys
    import threading
    import time
    import numpy as np
    import voxtile

    random = np.random.default_rng(1)
    points = random.uniform(-8, 8, (5_000, 3))
    directions = random.normal(size=(3_000, 3))
    boxes = np.hstack([points[:50], points[:50] + 0.5])
    until = time.monotonic() + float(sys.argv[2])
    failures, answers, is_over = [], 0, False

    def ask() -> None:
        global answers
        questions = [
            lambda: found.cast_rays(np.zeros((3_000, 3)), directions, max_range=10.0),
            lambda: found.occupancy(points),
            lambda: found.log_odds(points),
            lambda: found.counts(points),
            lambda: found.nearest(points[:50], 2.0),
            lambda: found.collides(boxes),
            lambda: found.occupied(),
            lambda: found.to_dense([[-2, -2, -2], [2, 2, 2]]),
        ]
        number = 0
        try:
            while not is_over:
                questions[number % len(questions)]()
                number += 1
                answers += 1
        except BaseException as error:
            failures.append(error)

    with voxtile.Map.create(sys.argv[1], 0.1, tile_size=1.6) as found:
        threads = [threading.Thread(target=ask) for _ in range(int(sys.argv[3]))]
        for thread in threads:
            thread.start()
        while time.monotonic() < until and not failures:
            pose = np.eye(4)
            pose[:3, 3] = random.uniform(-3, 3, 3)
            found.insert(random.uniform(-5, 5, (2_000, 3)), pose)
            if found.scan_number % 8 == 0:
                found.flush(wait=found.scan_number % 16 == 0)
        is_over = True
        for thread in threads:
            thread.join(timeout=60)
        assert not failures, failures
        assert not any(thread.is_alive() for thread in threads), "a query does not end"
        print(f"{answers} arrays of answers, {found.scan_number} scans")
    """


@pytest.mark.parametrize("threads", [1, 4, 8])
def test_array_queries_during_inserts(tmp_path: Path, threads: int) -> None:
    """VOXTILE_READER_SECONDS=300 for a long run."""
    seconds = float(os.environ.get("VOXTILE_READER_SECONDS", "1"))
    # If waiting queries started others on their stack, a small stack would overflow.
    stacks = {"RUST_MIN_STACK": str(256 << 10)}
    done = subprocess.run(
        ["sh", "-c", 'ulimit -s 256; exec "$@"', "sh", sys.executable, "-c", textwrap.dedent(ARRAYS)]
        + [str(tmp_path / "map"), str(seconds), str(threads)],
        env=os.environ | stacks,
        capture_output=True,
        text=True,
        timeout=seconds + 120,
    )
    assert done.returncode == 0, (done.returncode, done.stdout, done.stderr)
    print(done.stdout)


def test_threads_insert_into_different_maps_and_into_the_same(tmp_path: Path) -> None:
    scans = scans_of(2, count=12, points=1000)

    def insert(into: voxtile.Map) -> None:
        into.insert_many(scans)

    with voxtile.Map.create(tmp_path / "a", 0.1) as a, voxtile.Map.create(tmp_path / "b", 0.1) as b:
        threads = [threading.Thread(target=insert, args=(into,)) for into in (a, b, b)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(timeout=120)
        assert (a.scan_number, b.scan_number) == (12, 24)


def test_scans_accepted_during_close_are_in_the_map(tmp_path: Path) -> None:
    scan = np.random.default_rng(1).uniform(-20, 20, (5_000, 3))
    for attempt in range(3):
        found = voxtile.Map.create(tmp_path / str(attempt), 0.2, tile_size=2.0, memory="1GiB")
        found.insert(scan, np.eye(4))
        taken: list[int] = []

        def insert(found: voxtile.Map = found, taken: list[int] = taken) -> None:
            try:
                while True:
                    found.insert([[1.0, 2.0, 3.0]], np.eye(4))
                    taken.append(1)
            except voxtile.errors.ClosedError:
                pass

        threads = [threading.Thread(target=insert) for _ in range(4)]
        for thread in threads:
            thread.start()
        time.sleep(0.1)
        found.close()
        for thread in threads:
            thread.join(timeout=60)
        assert found.closed and len(taken) > 0
        with voxtile.open(tmp_path / str(attempt)) as kept:
            assert kept.scan_number == len(taken) + 1


def interrupted(script: str, *arguments: object) -> tuple[str, float]:
    """Runs a script until shortly after its first line, sends Ctrl-C, and returns its next line and the seconds
    until then.
    """
    # Shells start background processes with SIGINT ignored.
    handled = "import signal\nsignal.signal(signal.SIGINT, signal.default_int_handler)\n"
    process = subprocess.Popen(
        [sys.executable, "-c", handled + textwrap.dedent(script), *map(str, arguments)],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None and process.stdout.readline() == "begun\n"
    time.sleep(0.5)
    assert process.poll() is None
    began = time.monotonic()
    process.send_signal(signal.SIGINT)
    line = process.stdout.readline()
    took = time.monotonic() - began
    assert process.wait(timeout=120) == 0
    return line.strip(), took


def test_ctrl_c_ends_a_long_insert_and_the_map_is_intact(tmp_path: Path) -> None:
    script = """
        import sys
        import numpy as np
        import voxtile
        ends = np.random.default_rng(1).normal(size=(2_000_000, 3))
        ends *= 400 / np.linalg.norm(ends, axis=1)[:, None]
        with voxtile.Map.create(sys.argv[1], 0.02, tile_size=10.0, insert_mode="per-ray") as found:
            found.insert([[1.0, 2.0, 3.0]], np.eye(4))
            print("begun", flush=True)
            try:
                found.insert(ends, np.eye(4))
            except KeyboardInterrupt:
                print("interrupted", found.scan_number, flush=True)
        """
    line, took = interrupted(script, tmp_path / "map")
    assert line == "interrupted 1" and took < 2
    assert voxtile.verify(tmp_path / "map")["damage"] == 0


def test_ctrl_c_ends_a_short_call_that_waits_for_another_thread(tmp_path: Path) -> None:
    script = """
        import os
        import sys
        import threading
        import time
        import numpy as np
        import voxtile
        ends = np.random.default_rng(1).normal(size=(2_000_000, 3))
        ends *= 400 / np.linalg.norm(ends, axis=1)[:, None]
        found = voxtile.Map.create(sys.argv[1], 0.02, tile_size=10.0, insert_mode="per-ray")
        threading.Thread(target=lambda: found.insert(ends, np.eye(4)), daemon=True).start()
        time.sleep(0.5)
        print("begun", flush=True)
        try:
            found.insert([[1.0, 2.0, 3.0]], np.eye(4))
        except KeyboardInterrupt:
            print("interrupted", flush=True)
        os._exit(0)
        """
    line, took = interrupted(script, tmp_path / "map")
    assert line == "interrupted" and took < 2


def test_a_flush_finishes_after_ctrl_c(tmp_path: Path) -> None:
    script = """
        import sys
        import numpy as np
        import voxtile
        found = voxtile.Map.create(sys.argv[1], 0.2, tile_size=2.0, memory="1GiB")
        found.insert(np.random.default_rng(1).uniform(-20, 20, (20_000, 3)), np.eye(4))
        print("begun", flush=True)
        try:
            found.flush()
            print("flushed before", flush=True)
        except KeyboardInterrupt:
            print("interrupted", flush=True)
        """
    line, took = interrupted(script, tmp_path / "map")
    if line == "flushed before":
        pytest.skip("the flush ended before Ctrl-C")
    assert line == "interrupted" and took < 2
    # The interpreter waited for the flush.
    with voxtile.open(tmp_path / "map") as found:
        assert found.scan_number == 1


BUILD = """
    import sys
    import voxtile
    calls = []
    def progress(done, all):
        if not calls:
            print("begun", flush=True)
        calls.append(done)
    try:
        voxtile.build(sys.argv[1], sys.argv[2], resolution=0.1, max_range=50.0, progress=progress)
        print("built before", flush=True)
    except KeyboardInterrupt:
        print("interrupted", flush=True)
    """


def test_ctrl_c_in_a_build_keeps_accepted_scans(tmp_path: Path) -> None:
    random = np.random.default_rng(3)
    (tmp_path / "scans").mkdir()
    for number in range(200):
        points = random.normal(size=(20_000, 3)).astype(np.float32) * 20
        header = "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        sizes = f"WIDTH {len(points)}\nHEIGHT 1\nVIEWPOINT {number} 0 0 1 0 0 0\nPOINTS {len(points)}\nDATA binary\n"
        (tmp_path / "scans" / f"{number:03}.pcd").write_bytes((header + sizes).encode() + points.tobytes())
    line, took = interrupted(BUILD, tmp_path / "scans", tmp_path / "map")
    assert line == "interrupted" and took < 2
    assert voxtile.verify(tmp_path / "map")["damage"] == 0
    with voxtile.open(tmp_path / "map") as found:
        begun = found.scan_number
    assert 0 < begun < 200
    answer = voxtile.build(tmp_path / "scans", tmp_path / "map", resume=True, count=begun + 2)
    assert (answer["resumed_after"], answer["scan_number"]) == (begun, begun + 2)
    voxtile.build(tmp_path / "scans", tmp_path / "whole", resolution=0.1, max_range=50.0, count=begun + 2)
    assert voxtile.digest(tmp_path / "map") == voxtile.digest(tmp_path / "whole")
    script = """
        import sys
        import voxtile
        print("begun", flush=True)
        try:
            voxtile.export(sys.argv[1], sys.argv[2], what="all")
            print("written before", flush=True)
        except KeyboardInterrupt:
            print("interrupted", flush=True)
        """
    line, took = interrupted(script, tmp_path / "whole", tmp_path / "voxels.csv")
    assert line == "interrupted" and took < 2 and not (tmp_path / "voxels.csv").exists()


def test_a_callback_that_raises_ends_the_work(tmp_path: Path) -> None:
    with voxtile.Map.create(tmp_path / "map", 0.1) as found:
        found.insert_many(scans_of(4))

    def raising(done: int, all: int) -> None:
        raise RuntimeError(f"at {done} of {all}")

    with pytest.raises(RuntimeError, match="^at "):
        voxtile.convert(tmp_path / "map", tmp_path / "compact", "compact", progress=raising)
    assert not (tmp_path / "compact").exists()
    voxtile.convert(tmp_path / "map", tmp_path / "compact", "compact")
    assert voxtile.digest(tmp_path / "compact") == voxtile.digest(tmp_path / "map")


def test_no_pickle(tmp_path: Path) -> None:
    with voxtile.Map.create(tmp_path / "map") as found, pytest.raises(TypeError, match="path"):
        pickle.dumps(found)


def test_memory_of_many_maps_is_flat(tmp_path: Path) -> None:
    def resident() -> int:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE")

    if not Path("/proc/self/statm").exists():
        pytest.skip("no /proc")
    rounds = int(os.environ.get("VOXTILE_OPENS", "300"))
    points = np.random.default_rng(1).normal(size=(200, 3))
    voxtile.Map.create(tmp_path / "map", 0.5).close()
    sizes = []
    for number in range(rounds):
        with voxtile.Map.open(tmp_path / "map", memory="64MiB") as found:
            found.insert(points, np.eye(4))
            found.occupancy(points)
        if number >= rounds // 3:
            sizes.append(resident())
    assert max(sizes) - sizes[0] < 16 << 20, sizes


def test_ctrl_c_ends_a_few_long_queries(tmp_path: Path) -> None:
    script = """
        import sys
        import numpy as np
        import voxtile
        with voxtile.Map.create(sys.argv[1], 0.1, tile_size=1.0, max_range=40.0) as found:
            # Only free space: the search for the nearest voxel visits every tile.
            angles = np.linspace(0, 2 * np.pi, 2000)
            ends = 50 * np.stack([np.cos(angles), np.sin(angles), np.zeros(2000)], axis=1)
            found.insert(ends, np.eye(4))
            print("begun", flush=True)
            try:
                found.nearest(np.zeros((128, 3)), max_distance=np.inf)
                print("answered before", flush=True)
            except KeyboardInterrupt:
                print("interrupted", flush=True)
        """
    line, took = interrupted(script, tmp_path / "map")
    assert line == "interrupted" and took < 1


def test_rays_through_empty_space_are_fast(tmp_path: Path) -> None:
    with voxtile.Map.create(tmp_path / "map", 0.5, tile_size=10.0) as found:
        far = np.eye(4)
        far[:3, 3] = [4e8, 1e8, -3e7]
        for pose in [np.eye(4), far]:
            found.insert([[6.0, 0.0, 0.0]], pose)
        began = time.monotonic()
        directions = np.random.default_rng(1).normal(size=(100, 3))
        directions[0] = [4e8 + 6.25, 1e8 + 0.25, -3e7 + 0.25]
        distances, _ = found.cast_rays([0.0, 0.0, 0.0], directions)
        assert time.monotonic() - began < 2
        assert abs(distances[0] / np.linalg.norm(directions[0]) - 1) < 1e-6
