"""What tasks make, put where others find it: pieces of one map, under the id that it is to have."""

from __future__ import annotations

import fcntl
import glob
import os
import re
import shutil
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .._voxtile import move_piece
from ..errors import ArgumentError

# The id that all parts have.
MAP_ID = "map_id.json"

_LOCK = "lock"
# The name of an attempt's folder.
_ATTEMPT = re.compile("[0-9a-f]{32}")


def hand_over(made: str, place: str, map_id: str) -> None:
    """Moves what a worker made to its place, whole and durable; ``made`` is gone then.

    From another file system, or where ``made`` has another id, it is copied, and every byte is compared with its log.
    Another attempt may have been first, and made the same.
    """
    folder = os.path.dirname(place)
    attempt = os.path.join(folder, f"attempt-{uuid.uuid4().hex}")
    with _opened(folder) as opened:
        try:
            move_piece(made, attempt, map_id)
            _check_is_there(opened, folder)
            if not os.path.exists(place):
                os.rename(attempt, place)
                os.fsync(opened)
        except OSError:
            if not os.path.exists(place):
                raise
        finally:
            shutil.rmtree(attempt, ignore_errors=True)
            # Of a failure, a moment ago, on a disk that refused to have it removed.
            shutil.rmtree(f"{attempt}.unfinished", ignore_errors=True)
            _unmake_if_gone(opened, folder)


@contextmanager
def locked(parts: Path, own: re.Pattern[str]) -> Iterator[None]:
    """One process at a time makes a map; the lock ends with the process.

    What lies in the folder has names like ``own``. A folder with anything else is somebody's, and stays as it is.
    """
    _check_is_own(parts, own)
    parts.mkdir(parents=True, exist_ok=True)
    try:
        with _lock(parts):
            try:
                yield
            finally:
                # What was made stays for the next run; a folder without anything does not.
                with suppress(OSError):
                    if set(os.listdir(parts)) <= {_LOCK, MAP_ID}:
                        remove(parts)
    finally:
        _sweep(parts)


@contextmanager
def attempt_in(beside: Path) -> Iterator[Path]:
    """A new folder in ``beside``, which is removed in the end, and so is what a killed call left there.

    Its name is 32 hexadecimal digits. A task of an earlier attempt that was given up may still be at work in another.
    """
    with locked(beside, _ATTEMPT):
        attempt = beside / uuid.uuid4().hex
        try:
            attempt.mkdir()
            yield attempt
        finally:
            with suppress(OSError):
                remove(beside)


def remove(folder: Path) -> None:
    """Takes a folder of pieces away that nobody waits for any more; it is removed once the lock is given back.

    Tasks that were given up may still be at work. They find no folder of that name, so that they put nothing there.
    """
    os.rename(folder, folder.with_name(f"{folder.name}.gone-{uuid.uuid4().hex}"))


def _check_is_own(parts: Path, own: re.Pattern[str]) -> None:
    if parts.is_symlink() or (parts.exists() and not parts.is_dir()):
        raise ArgumentError(f"{parts}: pieces need a folder of this name, and it is a link or a file; move it away")
    for name in sorted(os.listdir(parts)) if parts.exists() else []:
        if (name != _LOCK and not own.fullmatch(name)) or (parts / name).is_symlink():
            raise ArgumentError(f"{parts}: {name} in it is of no earlier call; move the folder away")


@contextmanager
def _lock(parts: Path) -> Iterator[None]:
    path = parts / _LOCK
    # NFS gives a lock only to who may write.
    lock = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o666)
    try:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            # Whoever had it may have taken the folder away a moment ago.
            is_there = os.path.samestat(os.fstat(lock), os.stat(path))
        except OSError:
            is_there = False
        if not is_there:
            raise ArgumentError(f"{parts}: another process makes this map; wait for it")
        yield
    finally:
        os.close(lock)


def _sweep(parts: Path) -> None:
    """Removes what was taken away. Nobody has the lock open any more: NFS would keep that file, and the folder."""
    for gone in parts.parent.glob(f"{glob.escape(parts.name)}.gone-{'[0-9a-f]' * 32}"):
        for _ in range(_ATTEMPTS):
            shutil.rmtree(gone, ignore_errors=True)
            if not gone.exists():
                break
            # A task was just removing what it had made.
            time.sleep(0.1)


_ATTEMPTS = 10


@contextmanager
def _opened(folder: str) -> Iterator[int]:
    try:
        opened = os.open(folder, os.O_RDONLY)
    except FileNotFoundError:
        raise _gone(folder) from None
    try:
        yield opened
    finally:
        os.close(opened)


def _gone(folder: str) -> FileNotFoundError:
    return FileNotFoundError(f"{folder}: it is gone, so nobody waits for this piece any more")


def _check_is_there(opened: int, folder: str) -> None:
    if not os.path.samestat(os.fstat(opened), os.stat(folder)):
        raise _gone(folder)


def _unmake_if_gone(opened: int, folder: str) -> None:
    """A folder that was taken away while a piece was on its way was made again for that piece."""
    with suppress(OSError):
        if not os.path.samestat(os.fstat(opened), os.stat(folder)):
            os.rmdir(folder)
            if _ATTEMPT.fullmatch(os.path.basename(folder)):
                os.rmdir(os.path.dirname(folder))
