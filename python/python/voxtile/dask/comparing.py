"""Comparison of two maps by many workers: each compares a part of space, and the clusters are joined at the borders."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypedDict

import distributed

from .._voxtile import Comparison, compare_part, join_parts
from ..errors import ArgumentError
from . import losses

if TYPE_CHECKING:
    from numpy.typing import ArrayLike
    from typing_extensions import Unpack

_Path = str | os.PathLike[str]
_Map = _Path | tuple[_Path, str]

# The type hints of `distributed` are incomplete.
_dask: Any = distributed

# Parts per thread of a worker: a part with many changes takes longer than others.
_PARTS_PER_THREAD = 4


class CompareOptions(TypedDict, total=False):
    """Keywords of ``voxtile.compare``. ``memory`` is per task."""

    tolerance: float | None
    certainty: float
    min_voxels: int
    region: ArrayLike | None
    positions: tuple[ArrayLike | None, ArrayLike | None] | None
    memory: int | str | None


def compare(
    before: _Map,
    after: _Map,
    *,
    parts: int | None = None,
    client: distributed.Client | None = None,
    progress: Callable[[int, int], object] | None = None,
    **options: Unpack[CompareOptions],
) -> Comparison:
    """Compares two maps as ``voxtile.compare`` does, with the workers of ``client``, or of the current client.

    The result is the same for any number of ``parts`` (default: 4 per thread of a worker) and of workers. All workers
    and this process must see the maps, which must not change meanwhile: compare snapshots of maps that are being
    written. ``progress`` is called with the number of finished parts and their total.
    """
    found: Any = _dask.Client.current() if client is None else client
    places = (_place(before), _place(after))
    count = _PARTS_PER_THREAD * max(sum(found.nthreads().values()), 1) if parts is None else parts
    if count < 1:
        raise ArgumentError(f"parts: {count} is not at least 1")
    futures = [
        found.submit(_compare_part, *places, number, count, dict(options), pure=False, retries=2)
        for number in range(count)
    ]
    try:
        with losses.explained(use_less="use more parts", then="call again"):
            for done, _ in enumerate(_dask.as_completed(futures), 1):
                if progress is not None:
                    progress(done, count)
            results: list[bytes] = found.gather(futures)
    finally:
        found.cancel(futures)
    return join_parts(*places, results, dict(options))


def _place(map: _Map) -> Any:
    """Returns an absolute path, because workers run in other folders."""
    if isinstance(map, tuple):
        return os.path.abspath(map[0]), map[1]
    return os.path.abspath(map)


def _compare_part(before: Any, after: Any, part: int, parts: int, options: dict[str, Any]) -> bytes:
    return compare_part(before, after, part, parts, options)
