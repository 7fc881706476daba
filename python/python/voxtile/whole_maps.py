"""Functions of whole maps that are made of other parts of the package."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import Any

from . import errors
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


def export(path: str | os.PathLike[str], output: str | os.PathLike[str], *options: str) -> dict[str, Any]:
    """Writes a map for other programs; the name's ending says in which format, as for ``voxtile export``.

    ``options`` are those of the command (``"--region", "0", "0", "0", "5", "5", "5"``). It runs in a process of its
    own: what is not flushed is not exported. Returns what the command prints with ``--json``.
    """
    # Names are paths here, even those that begin with a dash.
    paths = [os.path.abspath(path), "-o", os.path.abspath(output)]
    done = subprocess.run(
        [sys.executable, "-m", "voxtile", "export", *paths, "--json", *options],
        capture_output=True,
        text=True,
        check=False,
    )
    lines = done.stdout.strip().splitlines()
    answer: dict[str, Any] = json.loads(lines[-1]) if lines and lines[-1].startswith("{") else {}
    if "error" in answer:
        error = answer["error"]
        tile = error.get("tile")
        raise errors.of_kind(
            error["kind"],
            error["message"],
            path=error.get("path"),
            tile=None if tile is None else (tile[0], tile[1], tile[2]),
            offset=error.get("offset"),
            line=error.get("line"),
        )
    if done.returncode != 0:
        raise errors.ArgumentError(done.stderr.strip() or f"voxtile export: exit code {done.returncode}")
    return answer
