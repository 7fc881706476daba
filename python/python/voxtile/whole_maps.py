"""Functions on whole maps that are implemented in Python."""

from __future__ import annotations

import os

from ._voxtile import Map


def open(path: str | os.PathLike[str], *, snapshot: str | None = None, memory: int | str | None = None) -> Map:
    """Opens a map, a snapshot, or a file of OctoMap (``.bt``, ``.ot``) for reading."""
    return Map.open(path, "r", snapshot=snapshot, memory=memory)


def digest(path: str | os.PathLike[str], *, snapshot: str | None = None) -> str:
    """Returns the digest of a map on disk, as the command prints it. Equal maps have equal digests."""
    with open(path, snapshot=snapshot) as found:
        return found.digest()


def snapshot(path: str | os.PathLike[str], name: str) -> None:
    """Keeps the last flush of a map as a snapshot. For an open map use ``Map.snapshot``."""
    with Map.open(path) as found:
        found.snapshot(name)
