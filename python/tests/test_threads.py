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


def test_a_reader_asks_while_another_thread_inserts(tmp_path: Path) -> None:
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


def test_two_threads_two_maps_and_one(tmp_path: Path) -> None:
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


def test_ctrl_c_ends_a_long_scan_and_the_map_is_whole(tmp_path: Path) -> None:
    script = textwrap.dedent(
        """
        import signal
        import sys
        import numpy as np
        import voxtile
        # Shells start what runs in the background without it.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        ends = np.random.default_rng(1).normal(size=(1_000_000, 3))
        ends *= 400 / np.linalg.norm(ends, axis=1)[:, None]
        with voxtile.Map.create(sys.argv[1], 0.02, tile_size=10.0, insert_mode="per-ray") as found:
            found.insert([[1.0, 2.0, 3.0]], np.eye(4))
            print("begun", flush=True)
            try:
                found.insert(ends, np.eye(4))
            except KeyboardInterrupt:
                print("interrupted", found.scan_number, flush=True)
        """
    )
    process = subprocess.Popen(
        [sys.executable, "-c", script, str(tmp_path / "map")], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None and process.stdout.readline() == "begun\n"
    time.sleep(2)
    assert process.poll() is None
    began = time.monotonic()
    process.send_signal(signal.SIGINT)
    line = process.stdout.readline()
    took = time.monotonic() - began
    process.wait(timeout=60)
    assert line == "interrupted 1\n" and took < 5
    assert voxtile.verify(tmp_path / "map")["damage"] == 0


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
