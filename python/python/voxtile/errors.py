"""Exceptions of voxtile: one class for each thing that can be done about it."""

from __future__ import annotations

from pathlib import Path
from typing import Any


class VoxtileError(Exception):
    """What every other is. The message names path, tile, offset or argument, and says what to do.

    ``path``, ``tile``, ``offset`` (in bytes), ``line`` and ``record`` are ``None`` where the error is not about one.
    """

    kind = "other"

    def __init__(
        self,
        message: str,
        *,
        path: str | Path | None = None,
        tile: tuple[int, int, int] | None = None,
        offset: int | None = None,
        line: int | None = None,
        record: int | None = None,
    ) -> None:
        super().__init__(message)
        self.path = None if path is None else Path(path)
        self.tile = tile
        self.offset = offset
        self.line = line
        self.record = record


class ArgumentError(VoxtileError, ValueError):
    """An argument is wrong: pass another."""

    kind = "invalid_argument"


class GridError(ArgumentError):
    """The lengths of voxel and tile do not fit: choose others."""

    kind = "grid"


class DiskError(VoxtileError):
    """The operating system refused: look at the path, the disk, the rights; then try again."""

    kind = "io"


class DamagedError(VoxtileError):
    """A file of a map is damaged: restore or repair it."""

    kind = "damaged"


class MalformedError(VoxtileError):
    """A file that was given to be read is not what it should be: give another."""

    kind = "malformed"


class NoMapError(VoxtileError):
    """There is no map at the path: create one, or name another path."""

    kind = "no_map"


class ExistsError(VoxtileError):
    """There is a map or other content at the path: open it, or choose another path."""

    kind = "already_exists"


class MismatchError(VoxtileError):
    """The map was made with other parameters: go on with its own."""

    kind = "mismatch"


class LockedError(VoxtileError):
    """Another writer has the map: wait for it or close it; readers may open it beside."""

    kind = "locked"


class LockLostError(VoxtileError):
    """The lock of the map was removed: close it and open it again, it is as of the last flush."""

    kind = "lock_lost"


class ChangedError(VoxtileError):
    """A writer flushed the map while it was read: refresh it or open it again."""

    kind = "changed"


class ExpiredError(VoxtileError):
    """The map changed too much while a question was answered: ask again, or for less."""

    kind = "expired"


class StoppedError(VoxtileError):
    """What was under way was given up: nothing of it is in the map."""

    kind = "stopped"


class NoAnswerError(VoxtileError):
    """A server stopped answering: look at the network and the server, then try again."""

    kind = "no_answer"


class UnsavedChangesError(VoxtileError):
    """A tile has updates that are not on disk: flush first."""

    kind = "unsaved_changes"


class TooLargeError(VoxtileError):
    """The answer would be too large: ask for less."""

    kind = "too_large"


class ClosedError(VoxtileError, ValueError):
    """The map is closed: open it again."""

    kind = "closed"


class ReadOnlyError(VoxtileError):
    """The map is open for reading alone: open it with mode "r+"."""

    kind = "read_only"


class PickleError(VoxtileError, TypeError):
    """A map cannot be pickled: open its path in the other process."""

    kind = "no_pickle"


class SnapshotsFailedError(VoxtileError):
    """Scans were removed, but these snapshots may still contain some: repair or delete them, then remove again.

    ``report`` is what ``remove_scans`` returns otherwise; its ``snapshots_failed`` has a name and a reason each.
    """

    kind = "snapshots_failed"
    report: dict[str, Any] | None = None


def _classes(of: type[VoxtileError]) -> dict[str, type[VoxtileError]]:
    classes = {of.kind: of}
    for subclass in of.__subclasses__():
        classes |= _classes(subclass)
    return classes


_BY_KIND = _classes(VoxtileError)


def of_kind(
    kind: str,
    message: str,
    *,
    path: str | Path | None = None,
    tile: tuple[int, int, int] | None = None,
    offset: int | None = None,
    line: int | None = None,
    record: int | None = None,
) -> VoxtileError:
    """The exception of a kind: the words of ``docs/json.md``, and those of this module's classes."""
    kind_of_error = _BY_KIND.get(kind, VoxtileError)
    return kind_of_error(message, path=path, tile=tile, offset=offset, line=line, record=record)
