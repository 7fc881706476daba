"""Marks of the points that hit something that moved, by many workers.

Tasks map the kept scans in reverse order, column by column. Then tasks compare ranges of scans with this map and with the
map itself, and write the marks that they find. The affected tiles are replayed as after other changes of scans.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import distributed
import numpy as np

from .. import _voxtile
from ..errors import ArgumentError
from .replaying import replaying

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

_Path = str | os.PathLike[str]
# Maps that a search needs: the scans in reverse order, the scans without marks, counts.
_Maps = tuple[str, str | None, str | None]


def clean(
    map: _Path,
    *,
    undo: bool = False,
    region: ArrayLike | None = None,
    parked_scans: int | None = None,
    keep_as: str | None = None,
    dry_run: bool = False,
    region_size: float | None = None,
    memory: int | str | None = None,
    client: distributed.Client | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> dict[str, Any]:
    """Marks the points of kept scans that hit something that moved, as ``voxtile.clean`` does, with the workers of
    ``client``, or of the current client.

    Tasks first map the scans in reverse order, and search ranges of scans for such points; then the rules of ``remap``
    apply. ``progress`` counts the tasks of each step. This process alone makes the estimate of ``dry_run``.
    """
    how: dict[str, Any] = {"region": region, "parked_scans": parked_scans}
    if undo and how != {"region": None, "parked_scans": None}:
        raise ArgumentError("undo: removes all marks; pass neither region nor parked_scans")
    if parked_scans is not None and parked_scans < 1:
        raise ArgumentError("parked_scans: must be at least 1")
    if dry_run:
        return _voxtile.clean(map, undo=undo, **how, keep_as=keep_as, dry_run=True, memory=memory, progress=progress)
    corners = None if region is None else np.asarray(region, np.float64)
    key = ["clean", None if corners is None else corners.tolist(), parked_scans]
    with replaying(map, region_size=region_size, memory=memory, client=client, progress=progress) as work:
        _, last, has_marks = _voxtile.check_replay(work.map, keep_as=keep_as, memory=memory)
        if undo:
            return work.join({"kind": "unmark"}, key=["unmark"], keep_as=keep_as)
        columns = work.columns_of_scans()

        def made(kind: Literal["reversed", "unmarked", "counts"], maps: _Maps | None = None) -> str:
            task = partial(_make_shard, kind, maps, memory)
            return work.make_map(kind, task, columns, key="clean")

        maps: _Maps = (made("reversed"), made("unmarked") if has_marks else None, None)
        if parked_scans is not None:
            maps = (*maps[:2], made("counts", maps))
        found = work.search("marks", _search_scans, last, maps, corners, parked_scans, memory, key=key)
        return work.join({"kind": "mark", "found": found}, key=key, keep_as=keep_as)


def _make_shard(
    kind: Literal["reversed", "unmarked", "counts"],
    maps: _Maps | None,
    memory: int | str | None,
    map: str,
    column: tuple[int, int],
    tiles: int,
    output: str,
    map_id: str,
) -> None:
    _voxtile.map_for_search(map, kind, column, tiles, output, shard_of=map_id, maps=maps, memory=memory)


def _search_scans(
    map: str,
    maps: _Maps,
    region: Any,
    parked_scans: int | None,
    memory: int | str | None,
    first: int,
    last: int,
    output: str,
) -> str:
    how: dict[str, Any] = {"region": region, "parked_scans": parked_scans, "memory": memory}
    return _voxtile.search_moving(map, maps, first, last, output, **how)
