"""Moves the shards that tasks make to the folder of the final map, with the id of that map."""

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

from .._voxtile import move_shard
from ..errors import ArgumentError

# Id of the map, which all its parts have.
MAP_ID = "map_id.json"

_LOCK = "lock"
# Name of the folder of an attempt.
_ATTEMPT = re.compile("[0-9a-f]{32}")


def move_to_place(made: str, place: str, map_id: str) -> None:
    """Moves a map from the worker's disk to its final place, atomically and durably, and removes ``made``.

    A map from another file system, or with another id, is copied, and every byte is checked against its log. If
    another attempt was first, its equal result is kept.
    """
    folder = os.path.dirname(place)
    attempt = os.path.join(folder, f"attempt-{uuid.uuid4().hex}")
    with _opened(folder) as opened:
        try:
            move_shard(made, attempt, map_id)
            _check_is_there(opened, folder)
            if not os.path.exists(place):
                os.rename(attempt, place)
                os.fsync(opened)
        except OSError:
            if not os.path.exists(place):
                raise
        finally:
            shutil.rmtree(attempt, ignore_errors=True)
            # Remains of a failed move whose removal failed too.
            shutil.rmtree(f"{attempt}.unfinished", ignore_errors=True)
            _unmake_if_gone(opened, folder)


@contextmanager
def locked(parts: Path, own: re.Pattern[str]) -> Iterator[None]:
    """Lets one process at a time build a map; the lock ends with the process.

    The folder may only contain names that match ``own``. A folder with other content is left unchanged and is an
    error.
    """
    _check_is_own(parts, own)
    parts.mkdir(parents=True, exist_ok=True)
    try:
        with _lock(parts):
            try:
                yield
            finally:
                # Keep results for the next run, but no empty folder.
                with suppress(OSError):
                    if set(os.listdir(parts)) <= {_LOCK, MAP_ID}:
                        remove(parts)
    finally:
        _sweep(parts)


@contextmanager
def attempt_in(folder: Path) -> Iterator[Path]:
    """Makes a new folder in ``folder`` and removes it at the end, with the remains of killed calls.

    Each call has a folder of its own (32 hexadecimal digits), because tasks of an abandoned call may still write to
    theirs.
    """
    with locked(folder, _ATTEMPT):
        attempt = folder / uuid.uuid4().hex
        try:
            attempt.mkdir()
            yield attempt
        finally:
            with suppress(OSError):
                remove(folder)


def remove(folder: Path) -> None:
    """Renames a folder of shards that is no longer needed; it is deleted after the lock is released.

    Tasks of an abandoned call may still run. They no longer find the folder, so they write nothing there.
    """
    os.rename(folder, folder.with_name(f"{folder.name}.gone-{uuid.uuid4().hex}"))


def _check_is_own(parts: Path, own: re.Pattern[str]) -> None:
    if parts.is_symlink() or (parts.exists() and not parts.is_dir()):
        raise ArgumentError(f"{parts}: is a link or a file, but a folder is needed here; move it away")
    for name in sorted(os.listdir(parts)) if parts.exists() else []:
        if (name != _LOCK and not own.fullmatch(name)) or (parts / name).is_symlink():
            raise ArgumentError(f"{parts}: contains {name}, which no earlier call has written; move the folder away")


@contextmanager
def _lock(parts: Path) -> Iterator[None]:
    path = parts / _LOCK
    # NFS grants a lock only with write access.
    lock = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o666)
    try:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            # The previous holder may have renamed the folder a moment ago.
            is_there = os.path.samestat(os.fstat(lock), os.stat(path))
        except OSError:
            is_there = False
        if not is_there:
            raise ArgumentError(f"{parts}: another process is building this map; wait for it")
        yield
    finally:
        os.close(lock)


def _sweep(parts: Path) -> None:
    """Deletes renamed folders. The lock file must be closed: NFS would keep an open file, and so the folder."""
    for gone in parts.parent.glob(f"{glob.escape(parts.name)}.gone-{'[0-9a-f]' * 32}"):
        for _ in range(_ATTEMPTS):
            shutil.rmtree(gone, ignore_errors=True)
            if not gone.exists():
                break
            # A task may just be removing its own shard.
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
    return FileNotFoundError(f"{folder}: was removed, so this shard is no longer needed")


def _check_is_there(opened: int, folder: str) -> None:
    if not os.path.samestat(os.fstat(opened), os.stat(folder)):
        raise _gone(folder)


def _unmake_if_gone(opened: int, folder: str) -> None:
    """Removes the folder if it was renamed during a move: the move created it anew."""
    with suppress(OSError):
        if not os.path.samestat(os.fstat(opened), os.stat(folder)):
            os.rmdir(folder)
            if _ATTEMPT.fullmatch(os.path.basename(folder)):
                os.rmdir(os.path.dirname(folder))
