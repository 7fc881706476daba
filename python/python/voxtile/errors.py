"""Exceptions of voxtile: one class per remedy."""

from __future__ import annotations

from pathlib import Path
from typing import Any


class VoxtileError(Exception):
    """Base class of all exceptions of voxtile. The message names the path, tile, offset or argument, and the
    remedy.

    ``path``, ``tile``, ``offset`` (in bytes), ``line`` and ``record`` are ``None`` if the error concerns
    none.
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
    """An argument is wrong: pass another value."""

    kind = "invalid_argument"


class GridError(ArgumentError):
    """The lengths of voxel and tile do not fit: choose others."""

    kind = "grid"


class DiskError(VoxtileError):
    """The operating system reported an error: check the path, the disk and the permissions, then try again."""

    kind = "io"


class DamagedError(VoxtileError):
    """A file of a map is damaged: restore or repair the map."""

    kind = "damaged"


class MalformedError(VoxtileError):
    """An input file is malformed: use another file."""

    kind = "malformed"


class NoMapError(VoxtileError):
    """There is no map at the path: create one, or pass another path."""

    kind = "no_map"


class ExistsError(VoxtileError):
    """A map or another file exists at the path: open it, or choose another path."""

    kind = "already_exists"


class MismatchError(VoxtileError):
    """The parameters differ from the map's: use those of the map."""

    kind = "mismatch"


class LockedError(VoxtileError):
    """Another writer has locked the map: wait for it or close it. Readers may open the map."""

    kind = "locked"


class LockLostError(VoxtileError):
    """The lock of the map was removed: close and reopen the map, which continues from the last flush."""

    kind = "lock_lost"


class ChangedError(VoxtileError):
    """A writer flushed the map during a read: refresh or reopen it."""

    kind = "changed"


class ExpiredError(VoxtileError):
    """The map changed too much during a query: query again, or query less."""

    kind = "expired"


class StoppedError(VoxtileError):
    """The operation was cancelled: it changed nothing in the map."""

    kind = "stopped"


class NoAnswerError(VoxtileError):
    """A server stopped responding: check the network and the server, then try again."""

    kind = "no_answer"


class UnsavedChangesError(VoxtileError):
    """A tile has changes that are not on disk: flush first."""

    kind = "unsaved_changes"


class TooLargeError(VoxtileError):
    """The result would be too large: query less."""

    kind = "too_large"


class ClosedError(VoxtileError, ValueError):
    """The map is closed: open it again."""

    kind = "closed"


class ReadOnlyError(VoxtileError):
    """The map is open for reading: open it with mode "r+" to change it."""

    kind = "read_only"


class PickleError(VoxtileError, TypeError):
    """A map cannot be pickled: open its path in the other process."""

    kind = "no_pickle"


class SnapshotsFailedError(VoxtileError):
    """Scans were removed, but these snapshots may still contain some: repair or delete them, then remove
    again.

    ``report`` is the report that ``remove_scans`` would return; its ``snapshots_failed`` lists names and
    reasons.
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
    """Returns the exception of a kind: one of ``docs/json.md``, or of a class of this module."""
    kind_of_error = _BY_KIND.get(kind, VoxtileError)
    return kind_of_error(message, path=path, tile=tile, offset=offset, line=line, record=record)
