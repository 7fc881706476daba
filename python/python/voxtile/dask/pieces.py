"""What tasks make, put where others find it: pieces of one map, under the id that it is to have."""

from __future__ import annotations

import os
import shutil
import uuid

from .._voxtile import move_piece


def hand_over(made: str, place: str, map_id: str) -> None:
    """Moves what a worker made to its place, whole and durable; ``made`` is gone then.

    From another file system, or where ``made`` has another id, it is copied, and every byte is compared with its log.
    Another attempt may have been first, and made the same.
    """
    folder = os.path.dirname(place)
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


def _sync(folder: str) -> None:
    opened = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)
