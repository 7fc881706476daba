"""A build in parts.

Space is divided into columns. A task maps the scans that reach a column into that column's tiles only, so tasks have
no order and share nothing, and a lost one is run again. Disjoint columns are pieces of the map of the whole, which gets
their files.
"""

from __future__ import annotations

import hashlib
import json
import math
import operator
import os
import re
import shutil
import tempfile
import time
import uuid
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from .. import files
from .._voxtile import adopt, crop, describe, join, verify
from ..errors import ArgumentError, VoxtileError
from ..files import ReadOptions
from . import losses
from .pieces import MAP_ID, hand_over, locked, remove
from .regions import Box, Column, Range, columns_of, region_of, scans_in, tiles_of
from .simulation import advised_region_size

try:
    import distributed
except ImportError:
    raise ImportError("voxtile.dask needs distributed: pip install voxtile[dask]") from None

if TYPE_CHECKING:
    from typing_extensions import Unpack

_Path = str | os.PathLike[str]
# What tells a scan from others, and where it may leave something.
_Seen = tuple[str, Box | None]

# Its types are not complete.
_dask: Any = distributed

# What does not commute with dividing space, or makes numbers of scans mean something else.
_READING_ONLY = {"every": 1, "first": 0, "count": None}

# Where ``voxtile build`` cuts rays if no range is named, into a new map and into one that it adds to.
_DEFAULT_RANGE_M = 100.0
# A plan of more is a mistake: dask would take minutes to hear of the tasks.
_MOST_REGIONS = 100_000


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
    resolution: float | None = None,
    region_size: float | None = None,
    update: bool = False,
    client: distributed.Client | None = None,
    progress: Callable[[int, int], object] | None = None,
    **options: Unpack[BuildOptions],
) -> dict[str, Any]:
    """Makes a map of a file or folder of scans with the workers of ``client``, or of the current one.

    The map has the digest of ``voxtile.build``, for any ``region_size`` (metres, along x and y) and any workers. All
    workers and this process need to see ``scans`` and the folder of ``out``. What is done lies in ``out + ".parts"``
    until the end; the same call after a failure goes on with it.

    With ``update`` the scans are added to the map ``out``, as ``voxtile.build`` does with ``append`` and ``again`` and
    the same keywords: name ``max_range`` and the like again, for a new run does not take them from the map.
    Only the regions that they reach are read; one flush puts all of them in place, so readers see the map before or
    after. A map that somebody else changes meanwhile is left as it is, with an error.

    ``progress`` is called with the regions done and their number. Returns numbers about the build.
    """
    began = time.perf_counter()
    output = Path(os.path.abspath(out))
    source = os.path.abspath(scans)
    settings: dict[str, Any] = {**options}
    if settings.get("max_range") is None:
        settings["max_range"] = _DEFAULT_RANGE_M
    if resolution is not None:
        settings["resolution"] = resolution
    base = _base(output, settings) if update else None
    tile_size = settings.get("tile_size", 10.0) if base is None else base.tile_size
    size = advised_region_size(settings["max_range"], tile_size) if region_size is None else region_size
    _check(output, size, tile_size, settings, update)
    found: Any = _dask.Client.current() if client is None else client
    parts = output.with_name(output.name + ".parts")
    with locked(parts, _OWN_NAMES):
        for attempt in parts.glob("attempt-*"):
            shutil.rmtree(attempt, ignore_errors=True)
        seen, plan_cpu = _plan(found, source, settings)
        planned = time.perf_counter()
        boxes = [box for _, box in seen]
        columns = columns_of(boxes, size, tile_size, most=_MOST_REGIONS)
        if not columns:
            raise ArgumentError(f"{source}: no scan has a point, so there is nothing to map")
        drive = _mark(source, size, settings, seen, str(output) if base else None)
        if base is not None and (adopted := _adopted_before(parts, drive, base)) is not None:
            remove(parts)
            return {**adopted, "output": str(output), "regions_done_before": adopted["regions"]}
        map_id = _id_of(parts) if base is None else base.map_id
        # A task of a call that was given up may still put its part here, for a map of another id.
        mark = _mark(drive, map_id, None if base is None else base.flush_number)
        wanted = {parts / f"{mark}-{x}-{y}": ((x, y), ranges) for (x, y), ranges in columns.items()}
        open_parts = {part: what for part, what in wanted.items() if not part.exists()}
        # Long tasks first: a short one at the end keeps few workers waiting.
        longest = sorted(open_parts.items(), key=lambda what: -scans_in(what[1][1]))
        of_map = None if base is None else str(output)
        how = ((size, tile_size), settings, of_map)
        checks = [
            found.submit(_check_part, str(part), pure=False, retries=2) for part in wanted if part not in open_parts
        ]
        futures = [
            found.submit(_map_column, source, str(part), map_id, column, ranges, *how, pure=False, retries=2)
            for part, (column, ranges) in longest
        ]
        try:
            for check in _dask.as_completed(checks):
                _result(check)
            tasks: list[dict[str, Any]] = []
            for future in _dask.as_completed(futures):
                tasks.append(_result(future))
                if progress is not None:
                    progress(len(columns) - len(open_parts) + len(tasks), len(columns))
        finally:
            found.cancel([*checks, *futures])
        mapped, merge_cpu = time.perf_counter(), time.process_time()
        read = sum(scans_in(ranges) for ranges in columns.values())
        told = {
            "output": str(output),
            "region_size": size,
            "regions": len(columns),
            "regions_done_before": len(columns) - len(open_parts),
            "scans": len(boxes),
            "scans_read": read,
            "overlap": read / max(len(boxes), 1),
        }
        names = [str(part) for part in sorted(wanted)]
        if base is None:
            told["tiles"] = join(names, str(output))["tiles"]
        else:
            told["adopted"] = _adopt(output, names, drive, base, told)
        remove(parts)
    ended, ended_cpu = time.perf_counter(), time.process_time()
    seconds = sorted((task["seconds"] for task in tasks), reverse=True)
    return {
        **told,
        "workers": len(found.nthreads()),
        "dashboard": found.dashboard_link,
        "seconds": {"plan": planned - began, "map": mapped - planned, "merge": ended - mapped},
        "cpu_seconds": {
            "plan": plan_cpu,
            "map": sum(task["cpu_seconds"] for task in tasks),
            "merge": ended_cpu - merge_cpu,
        },
        "skew": seconds[0] * len(seconds) / sum(seconds) if seconds else None,
        "slowest": sorted(tasks, key=lambda task: -task["seconds"])[:5],
    }


@dataclass(frozen=True)
class _Base:
    """The map that an update goes on with, as of its last flush."""

    map_id: str
    flush_number: int
    scan_number: int
    # Scans that its list of scans does not have: those of updates. ``None`` if that is not known.
    unlisted_scans: int | None
    tile_size: float


# Says which update is being put in place, so that it is not done twice.
_ADOPTING = "adopting.json"

# What calls leave in the folder of parts.
_OWN_NAMES = re.compile(
    r"(map_id|adopting)\.(json|new)|attempt-[0-9a-f]{32}(\.unfinished)?|[0-9a-f]{16}-(-?[0-9]+)-(-?[0-9]+)"
)


def _base(output: Path, settings: dict[str, Any]) -> _Base:
    told = describe(str(output))
    if told["keeps_scans"]:
        raise ArgumentError(f"{output}: it keeps its scans, which a build in parts does not; use voxtile.build")
    for name in ("resolution", "tile_size"):
        if settings.get(name, told[name]) != told[name]:
            raise ArgumentError(f"{name}: the map has {told[name]} m; leave it out")
    scans, listed = told["scan_number"], told["scan_records"]
    unlisted = None if listed is None else scans - listed
    return _Base(str(told["map_id"]), told["flush_number"], scans, unlisted, told["tile_size"])


def _mark(*what: object) -> str:
    identity = json.dumps([version("voxtile"), *what], sort_keys=True, default=str)
    return hashlib.sha256(identity.encode()).hexdigest()[:16]


def _note(path: Path, what: object) -> None:
    beside = path.with_suffix(".new")
    with open(beside, "w", encoding="utf-8") as file:
        json.dump(what, file)
        file.flush()
        os.fsync(file.fileno())
    os.replace(beside, path)


def _adopt(output: Path, names: Sequence[str], drive: str, base: _Base, told: dict[str, Any]) -> dict[str, Any]:
    note = Path(names[0]).parent / _ADOPTING
    _note(note, {"drive": drive, "map": asdict(base), "told": told})
    try:
        adopted: dict[str, Any] = adopt(str(output), names, of_flush=base.flush_number, scans=told["scans"])
    except ArgumentError:
        # The map is as somebody else left it. After other errors nobody knows.
        note.unlink()
        raise
    return adopted


def _adopted_before(parts: Path, drive: str, base: _Base) -> dict[str, Any] | None:
    """What a call told that put these scans in place and was killed before it removed the parts."""
    try:
        noted: dict[str, Any] = json.loads((parts / _ADOPTING).read_text(encoding="utf-8"))
    except (FileNotFoundError, ValueError):
        return None
    before = _Base(**noted["map"])
    if noted["drive"] != drive or before.map_id != base.map_id or before.flush_number == base.flush_number:
        return None
    told: dict[str, Any] = noted["told"]
    # The number of a flush tells nothing: it may be another writer's, whose scans are in the list.
    added = _difference(base.unlisted_scans, before.unlisted_scans)
    if added == told["scans"]:
        return told
    if added is not None and added <= 0:
        return None
    raise ArgumentError(
        f"{parts}: an earlier call ended while it put {told['scans']} scans in place after scan {before.scan_number},"
        f" and {told['output']} has changed since; look whether it has them, remove {parts}, and call again if not"
    )


def _difference(number: int | None, other: int | None) -> int | None:
    return None if number is None or other is None else number - other


def _id_of(parts: Path) -> str:
    """The id of the map to come: all its parts have it, those of an earlier call, too."""
    note = parts / MAP_ID
    try:
        noted: str = json.loads(note.read_text(encoding="utf-8"))
    except (FileNotFoundError, ValueError):
        noted = uuid.uuid4().hex
        _note(note, noted)
    return noted


def _check_part(part: str) -> dict[str, Any]:
    """Reads a part of an earlier call: what happened to it since, nobody knows."""
    done = verify(part)
    for finding in done["findings"]:
        if finding["severity"] == "damage":
            raise VoxtileError(f"{finding['path']}: {finding['reason']}; remove {part}, and call again to go on")
    return done


def _result(future: Any) -> dict[str, Any]:
    """What a task answers; an error says which worker to look at."""
    with losses.told(use_less="take a smaller region_size or memory", then=_GO_ON):
        done: dict[str, Any] = future.result()
    return done


# What to do after a loss.
_GO_ON = "call again to go on: the regions that are done are kept"


def _check(output: Path, region_size: float, tile_size: float, options: Any, update: bool) -> None:
    # A column narrower than two tiles may have the center of none.
    if not (math.isfinite(region_size) and region_size >= 2 * tile_size):
        raise ArgumentError(f"region_size: {region_size} m is less than two tiles of {tile_size} m; take more")
    if not update and "resolution" not in options:
        raise ArgumentError("resolution: a new map needs the edge of its voxels in metres")
    if not update and output.exists():
        raise ArgumentError(f"{output}: it exists; name a new map, or remove it")
    allowed = {"resolution", *BuildOptions.__annotations__, *ReadOptions.__annotations__}
    for name in options:
        if name not in allowed:
            raise ArgumentError(f"{name}: a build in parts does not take it; use voxtile.build")
    for name, value in _READING_ONLY.items():
        if options.get(name, value) != value:
            raise ArgumentError(f"{name}: a build in parts takes all scans; leave it out, or use voxtile.build")


def _plan(client: Any, source: str, settings: dict[str, Any]) -> tuple[list[_Seen], float]:
    """What each scan is, and where it may leave something, ``None`` for nowhere; and the seconds of CPU for that."""
    reading = {name: value for name, value in settings.items() if name in ReadOptions.__annotations__}
    reach = (settings["max_range"], settings.get("clear_no_return"))
    # Other formats that do not tell how many there are would be read as a whole for it: a single task does that, too.
    is_stream = source.lower().endswith(".scans")
    scans = files.count_scans(source, **reading) if is_stream else operator.length_hint(files.scans(source, **reading))
    workers = max(sum(client.nthreads().values()), 1)
    step = max(math.ceil(scans / (4 * workers)), 1)
    firsts = list(range(0, scans, step)) or [0]
    # The last one takes what an estimate left out.
    spans = [(first, None if first == firsts[-1] else step) for first in firsts]
    tasks = [client.submit(_boxes, source, *span, reading, reach, pure=False, retries=2) for span in spans]
    with losses.told(use_less="take workers with fewer threads", then=_GO_ON):
        found = client.gather(tasks)
    return [scan for part, _ in found for scan in part], sum(cpu for _, cpu in found)


def _boxes(
    source: str,
    first: int,
    count: int | None,
    reading: dict[str, Any],
    reach: tuple[float | None, float | None],
) -> tuple[list[_Seen], float]:
    began = time.process_time()
    max_range, clear_no_return = reach
    options: dict[str, Any] = {**reading, "first": first, "count": count}
    seen = files.reaches(source, max_range=max_range, clear_no_return=clear_no_return, **options)
    return seen, time.process_time() - began


def _map_column(
    source: str,
    part: str,
    map_id: str,
    column: Column,
    ranges: Sequence[Range],
    sizes: tuple[float, float],
    settings: dict[str, Any],
    of_map: str | None,
) -> dict[str, Any]:
    """Maps a column on the worker's disk, and puts a piece of the map beside the others.

    ``sizes`` are a column's and a tile's.
    """
    began, cpu_began = time.perf_counter(), time.process_time()
    with tempfile.TemporaryDirectory(prefix="voxtile-", dir=_dask.get_worker().local_directory) as local:
        made = os.path.join(local, "map")
        try:
            if of_map is not None:
                crop(of_map, made, tiles_of(column, *sizes), piece_of=map_id)
            for first, last in ranges:
                options: dict[str, Any] = {**settings, "first": first, "count": last - first}
                # A later range begins as another input may have: these are other scans.
                goes_on: dict[str, Any] = {"append": True, "again": True} if os.path.exists(made) else {}
                files.build_piece(source, made, map_id, region=region_of(column, sizes[0]), **options, **goes_on)
            hand_over(made, part, map_id)
        except VoxtileError as error:
            # Of the classes of errors, callers look at the class and the message.
            worker = _dask.get_worker()
            error.args = (f"{error} (worker {worker.address}, whose disk is {worker.local_directory})",)
            raise
    return {
        "column": list(column),
        "ranges": len(ranges),
        "scans": scans_in(ranges),
        "seconds": time.perf_counter() - began,
        "cpu_seconds": time.process_time() - cpu_began,
    }
