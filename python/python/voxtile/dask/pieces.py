"""What tasks make, put where others find it: pieces of one map, under the id that it is to have."""

from __future__ import annotations

import fcntl
import os
import shutil
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .._voxtile import move_piece
from ..errors import ArgumentError

# The id that all parts have.
MAP_ID = "map_id.json"


def hand_over(made: str, place: str, map_id: str) -> None:
    """Moves what a worker made to its place, whole and durable; ``made`` is gone then.

    From another file system, or where ``made`` has another id, it is copied, and every byte is compared with its log.
    Another attempt may have been first, and made the same.
    """
    folder = os.path.dirname(place)
    if not os.path.isdir(folder):
        raise FileNotFoundError(f"{folder}: it is gone, so nobody waits for this piece any more")
    attempt = os.path.join(folder, f"attempt-{uuid.uuid4().hex}")
    try:
        move_piece(made, attempt, map_id)
        if not os.path.exists(place):
            os.rename(attempt, place)
            _sync(folder)
    except OSError:
        if not os.path.exists(place):
            raise
    finally:
        shutil.rmtree(attempt, ignore_errors=True)
        # Of a failure, a moment ago, on a disk that refused to have it removed.
        shutil.rmtree(f"{attempt}.unfinished", ignore_errors=True)


@contextmanager
def locked(parts: Path) -> Iterator[None]:
    """One process at a time makes a map; the lock ends with the process."""
    parts.mkdir(parents=True, exist_ok=True)
    with open(parts / "lock", "w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise ArgumentError(f"{parts}: another process makes this map; wait for it") from None
        try:
            yield
        finally:
            # What was made stays for the next run; a folder without anything does not.
            if parts.exists() and set(os.listdir(parts)) <= {"lock", MAP_ID}:
                shutil.rmtree(parts)


def remove(folder: Path) -> None:
    """Removes a folder of pieces that nobody waits for any more.

    Tasks that were given up may still be at work. They find no folder of that name, so that they put nothing there.
    """
    gone = folder.with_name(f"{folder.name}.gone-{uuid.uuid4().hex}")
    os.rename(folder, gone)
    for _ in range(_ATTEMPTS):
        shutil.rmtree(gone, ignore_errors=True)
        if not gone.exists():
            return
        # A task was just removing what it had made.
        time.sleep(0.1)


_ATTEMPTS = 10


def _sync(folder: str) -> None:
    opened = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)
