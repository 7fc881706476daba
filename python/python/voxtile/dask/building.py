"""A build in parts.

Space is divided into columns. A task maps the scans that reach a column into that column's tiles only, so tasks have
no order and share nothing, and a lost one is run again. Disjoint columns merge to the map of the whole.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import math
import operator
import os
import shutil
import tempfile
import time
import uuid
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from .. import files
from .._voxtile import merge
from ..errors import ArgumentError, VoxtileError
from ..files import ReadOptions

try:
    import distributed
except ImportError:
    raise ImportError("voxtile.dask needs distributed: pip install voxtile[dask]") from None

if TYPE_CHECKING:
    from typing_extensions import Unpack

_Path = str | os.PathLike[str]
_Box = tuple[float, float, float, float]
_Column = tuple[int, int]
# What tells a scan from others, and where it may leave something.
_Seen = tuple[str, _Box | None]

# Its types are not complete.
_dask: Any = distributed

# Regions of fewer tiles read most scans many times.
_DEFAULT_REGION_TILES = 20
# What does not commute with dividing space, or makes numbers of scans mean something else.
_READING_ONLY = {"every": 1, "first": 0, "count": None}


class BuildOptions(ReadOptions, total=False):
    """How a map is built: the keywords of ``voxtile.build`` that a build in parts can take. ``memory`` is a task's."""

    tile_size: float
    storage: Literal["octomap", "compact"]
    memory: int | str
    min_range: float
    max_range: float | None
    sensor_model: Literal["log-odds", "iwlo"]
    probabilities: Sequence[float] | None
    occupancy_threshold: float
    intensity_threshold: float
    intensity_max: float
    insert_mode: Literal["per-scan", "per-ray"]
    clear_no_return: float | None


def build(
    scans: _Path,
    out: _Path,
    *,
    resolution: float,
    region_size: float | None = None,
    client: distributed.Client | None = None,
    progress: Callable[[int, int], object] | None = None,
    **options: Unpack[BuildOptions],
) -> dict[str, Any]:
    """Makes a map of a file or folder of scans with the workers of ``client``, or of the current one.

    The map has the digest of ``voxtile.build``, for any ``region_size`` (metres, along x and y) and any workers. All
    workers and this process need to see ``scans`` and the folder of ``out``. What is done lies in ``out + ".parts"``
    until the end; the same call after a failure goes on with it. ``progress`` is called with the regions done and
    their number. Returns numbers about the build.
    """
    output = Path(os.path.abspath(out))
    source = os.path.abspath(scans)
    tile_size = options.get("tile_size", 10.0)
    size = tile_size * _DEFAULT_REGION_TILES if region_size is None else region_size
    _check(output, size, tile_size, options)
    found: Any = _dask.Client.current() if client is None else client
    settings: dict[str, Any] = {"resolution": resolution, **options}
    parts = output.with_name(output.name + ".parts")
    with _locked(parts):
        for attempt in parts.glob("attempt-*"):
            shutil.rmtree(attempt, ignore_errors=True)
        seen = _plan(found, source, dict(options))
        boxes = [box for _, box in seen]
        columns = _columns(boxes, size, tile_size)
        if not columns:
            raise ArgumentError(f"{source}: no scan has a point, so there is nothing to map")
        identity = json.dumps([version("voxtile"), source, size, settings, seen], sort_keys=True, default=str)
        mark = hashlib.sha256(identity.encode()).hexdigest()[:16]
        wanted = {parts / f"{mark}-{x}-{y}": ((x, y), span) for (x, y), span in columns.items()}
        open_parts = {part: what for part, what in wanted.items() if not part.exists()}
        futures = [
            found.submit(_map_column, source, str(part), column, size, span, settings, pure=False, retries=2)
            for part, (column, span) in open_parts.items()
        ]
        try:
            tasks = []
            for future in _dask.as_completed(futures):
                tasks.append(_result(future))
                if progress is not None:
                    progress(len(columns) - len(open_parts) + len(tasks), len(columns))
        finally:
            found.cancel(futures)
        merged = merge([str(part) for part in sorted(wanted)], str(output))
        read = sum(last - first for first, last in columns.values())
        shutil.rmtree(parts)
    seconds = sorted((task["seconds"] for task in tasks), reverse=True)
    return {
        "output": str(output),
        "regions": len(columns),
        "regions_done_before": len(columns) - len(open_parts),
        "scans": len(boxes),
        "scans_read": read,
        "overlap": read / max(len(boxes), 1),
        "tiles": merged.get("tiles"),
        "cpu_seconds": sum(task["cpu_seconds"] for task in tasks),
        "skew": seconds[0] * len(seconds) / sum(seconds) if seconds else None,
        "slowest": sorted(tasks, key=lambda task: -task["seconds"])[:5],
    }


def _result(future: Any) -> dict[str, Any]:
    """What a task answers; an error says which worker to look at."""
    try:
        done: dict[str, Any] = future.result()
    except _dask.KilledWorker as error:
        raise VoxtileError(
            f"{error.last_worker.address}: this worker and others have ended while they made a region; perhaps memory"
            " was short: take a smaller region_size or memory, or workers with more, and call again to go on"
        ) from error
    except CancelledError as error:
        raise VoxtileError(
            f"{error}; the regions that are done are kept: call again to go on, with a client of a scheduler that runs"
        ) from error
    return done


def _check(output: Path, region_size: float, tile_size: float, options: Any) -> None:
    # A column narrower than two tiles may have the center of none.
    if not (math.isfinite(region_size) and region_size >= 2 * tile_size):
        raise ArgumentError(f"region_size: {region_size} m is less than two tiles of {tile_size} m; take more")
    if output.exists():
        raise ArgumentError(f"{output}: it exists; name a new map, or remove it")
    allowed = BuildOptions.__annotations__.keys() | ReadOptions.__annotations__.keys()
    for name in options:
        if name not in allowed:
            raise ArgumentError(f"{name}: a build in parts does not take it; use voxtile.build")
    for name, value in _READING_ONLY.items():
        if options.get(name, value) != value:
            raise ArgumentError(f"{name}: a build in parts takes all scans; leave it out, or use voxtile.build")


@contextmanager
def _locked(parts: Path) -> Iterator[None]:
    """One process at a time makes a map; the lock ends with the process."""
    parts.mkdir(parents=True, exist_ok=True)
    with open(parts / "lock", "w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise ArgumentError(f"{parts}: another process makes this map; wait for it") from None
        try:
            yield
        finally:
            # What was made stays for the next run; a folder without anything does not.
            if parts.exists() and os.listdir(parts) == ["lock"]:
                shutil.rmtree(parts)


def _plan(client: Any, source: str, options: dict[str, Any]) -> list[_Seen]:
    """What each scan is, and where it may leave something: west, south, east, north. ``None`` is nowhere."""
    reading = {name: value for name, value in options.items() if name in ReadOptions.__annotations__}
    reach = (options.get("max_range"), options.get("clear_no_return"))
    scans = operator.length_hint(files.scans(source, **reading))
    workers = max(sum(client.nthreads().values()), 1)
    step = max(math.ceil(scans / (4 * workers)), 1)
    firsts = list(range(0, scans, step)) or [0]
    # The last one takes what an estimate left out.
    spans = [(first, None if first == firsts[-1] else step) for first in firsts]
    tasks = [client.submit(_boxes, source, *span, reading, reach, pure=False, retries=2) for span in spans]
    return [scan for part in client.gather(tasks) for scan in part]


def _boxes(
    source: str,
    first: int,
    count: int | None,
    reading: dict[str, Any],
    reach: tuple[float | None, float | None],
) -> list[_Seen]:
    max_range, clear_no_return = reach
    seen: list[_Seen] = []
    options: dict[str, Any] = {**reading, "first": first, "count": count}
    for points, pose, intensities in files.scans(source, **options):
        content = hashlib.blake2b(points.tobytes() + pose.tobytes(), digest_size=16)
        content.update(b"" if intensities is None else intensities.tobytes())
        origin = pose[:2, 3]
        ends = (points @ pose[:3, :3].T + pose[:3, 3])[:, :2]
        ends = ends[np.isfinite(ends).all(axis=1)]
        if max_range is not None:
            ends = np.clip(ends, origin - max_range, origin + max_range)
        if clear_no_return is not None:
            ends = np.concatenate([ends, [origin - clear_no_return, origin + clear_no_return]])
        if len(ends) == 0:
            seen.append((content.hexdigest(), None))
            continue
        low, high = np.minimum(ends.min(axis=0), origin), np.maximum(ends.max(axis=0), origin)
        box = (float(low[0]), float(low[1]), float(high[0]), float(high[1]))
        seen.append((content.hexdigest(), box))
    return seen


def _columns(boxes: Sequence[_Box | None], size: float, tile_size: float) -> dict[_Column, tuple[int, int]]:
    """The columns that scans may reach, and of each the first scan and the one after the last."""
    columns: dict[_Column, tuple[int, int]] = {}
    # A tile whose center is in a column reaches half of its edge beyond; the other half is slack for rounding.
    margin = tile_size
    for number, box in enumerate(boxes):
        if box is None:
            continue
        west, south, east, north = box
        for x in range(math.floor((west - margin) / size), math.floor((east + margin) / size) + 1):
            for y in range(math.floor((south - margin) / size), math.floor((north + margin) / size) + 1):
                first, _ = columns.get((x, y), (number, number))
                columns[x, y] = (first, number + 1)
    return columns


def _map_column(
    source: str, part: str, column: _Column, size: float, span: tuple[int, int], settings: dict[str, Any]
) -> dict[str, Any]:
    """Maps a column on the worker's disk, and puts it beside the others whole."""
    began, cpu_began = time.perf_counter(), time.process_time()
    x, y = column
    region = [x * size, y * size, -math.inf, (x + 1) * size, (y + 1) * size, math.inf]
    with tempfile.TemporaryDirectory(prefix="voxtile-", dir=_dask.get_worker().local_directory) as local:
        made = os.path.join(local, "map")
        first, last = span
        options: dict[str, Any] = {**settings, "first": first, "count": last - first, "region": region}
        try:
            files.build(source, made, **options)
        except VoxtileError as error:
            # Of the classes of errors, callers look at the class and the message.
            worker = _dask.get_worker()
            error.args = (f"{error} (worker {worker.address}, whose disk is {worker.local_directory})",)
            raise
        attempt = os.path.join(os.path.dirname(part), f"attempt-{uuid.uuid4().hex}")
        try:
            shutil.copytree(made, attempt)
            # Another attempt may have been first; both made the same.
            if not os.path.exists(part):
                os.rename(attempt, part)
        except OSError:
            if not os.path.exists(part):
                raise
        finally:
            shutil.rmtree(attempt, ignore_errors=True)
    return {
        "column": list(column),
        "scans": last - first,
        "seconds": time.perf_counter() - began,
        "cpu_seconds": time.process_time() - cpu_began,
    }
