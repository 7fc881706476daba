"""Functions of whole maps that are made of other parts of the package."""

from __future__ import annotations

import os

from ._voxtile import Map


def open(path: str | os.PathLike[str], *, snapshot: str | None = None, memory: int | str | None = None) -> Map:
    """Opens a map, a snapshot of one, or a file of OctoMap (``.bt``, ``.ot``), to be asked."""
    return Map.open(path, "r", snapshot=snapshot, memory=memory)


def digest(path: str | os.PathLike[str], *, snapshot: str | None = None) -> str:
    """The digest of a map on disk: equal for equal maps, as the command prints it."""
    with open(path, snapshot=snapshot) as found:
        return found.digest()


def snapshot(path: str | os.PathLike[str], name: str) -> None:
    """Keeps the last flush of a map under a name. Of an open map use ``Map.snapshot``."""
    with Map.open(path) as found:
        found.snapshot(name)
