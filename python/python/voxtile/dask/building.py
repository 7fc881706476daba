"""A build divided into columns of tiles.

Each task maps the scans that reach its column, and only into that column's tiles. Tasks therefore have no order and
share no state, and a lost task can run again. The results are disjoint shards, whose files become those of the map.
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
from .._voxtile import crop, default_tile_size, describe, join, replace_tiles, verify
from ..errors import ArgumentError, VoxtileError
from ..files import ReadOptions
from . import losses
from .shards import MAP_ID, move_to_place, locked, remove
from .regions import Box, Column, Range, columns_of, region_of, scans_in, tiles_of, with_unreached
from .simulation import advised_region_size

try:
    import distributed
except ImportError:
    raise ImportError("voxtile.dask needs distributed: pip install voxtile[dask]") from None

if TYPE_CHECKING:
    from typing_extensions import Unpack

_Path = str | os.PathLike[str]
# A scan's fingerprint, and the box that it may change.
_ScanBox = tuple[str, Box | None]

# The type hints of `distributed` are incomplete.
_dask: Any = distributed

# Options that are not supported, with their defaults: each task would apply them to its own scans.
_UNSUPPORTED = {"every": 1, "first": 0, "count": None}

# Default range of ``voxtile build``.
_DEFAULT_RANGE_M = 100.0
# Limit on the number of regions: dask needs minutes to submit more tasks, so more is assumed to be a mistake.
_MAX_REGIONS = 100_000


class BuildOptions(ReadOptions, total=False):
    """Options of a distributed build: the keywords of ``voxtile.build`` that it supports. ``memory`` is per task."""

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
    clearing: Literal["octomap", "guarded"]
    layers: str
    keep_scans: bool
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
    """Builds a map from a file or folder of scans with the workers of ``client``, or of the current client.

    The map has the digest of ``voxtile.build``, for any ``region_size`` (metres, along x and y) and any number of
    workers. All workers and this process must see ``scans`` and the folder of ``out``. Finished regions are kept in
    ``out + ".parts"`` until the end; after a failure, the same call resumes from them. With ``keep_scans`` the map
    keeps each scan once, with the number and content that ``voxtile.build`` gives it.

    With ``update`` the scans are added to the map ``out``, as ``voxtile.build`` does with ``append`` and ``again``
    and the same keywords. A map that keeps its scans keeps the new ones too. Pass ``max_range`` and similar options
    again: they are not taken from the map. Only the regions that the scans reach are read. One flush replaces all
    changed tiles, so readers see the map before or after the update. If another process changes the map meanwhile, the
    update raises an error and the map keeps that process's changes.

    ``progress`` is called with the number of finished regions and their total. Returns a report of the build.
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
    tile_size: float | None = settings.get("tile_size") if base is None else base.tile_size
    if tile_size is None:
        tile_size = default_tile_size(settings.get("resolution", 0.1))
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
        columns = columns_of(boxes, size, tile_size, most=_MAX_REGIONS)
        if not columns:
            raise ArgumentError(f"{source}: no scan has a point; check the input")
        if settings.get("keep_scans"):
            columns = with_unreached(columns, boxes)
        drive = _fingerprint(source, size, settings, seen, str(output) if base else None)
        if base is not None and (adopted := _committed_before(parts, drive, source, base)) is not None:
            remove(parts)
            return {**adopted, "output": str(output), "regions_done_before": adopted["regions"]}
        map_id = _id_of(parts) if base is None else base.map_id
        # The names of parts depend on the id of the map, because a task of an abandoned call may still write a part
        # here.
        mark = _fingerprint(drive, map_id, None if base is None else base.flush_number)
        wanted = {parts / f"{mark}-{x}-{y}": ((x, y), ranges) for (x, y), ranges in columns.items()}
        open_parts = {part: what for part, what in wanted.items() if not part.exists()}
        # Start with the longest tasks: a short one at the end keeps few workers idle.
        longest = sorted(open_parts.items(), key=lambda what: -scans_in(what[1][1]))
        how = ((size, tile_size), settings, None if base is None else (str(output), base.scan_number))
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
        report = {
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
            report["tiles"] = join(names, str(output))["tiles"]
        else:
            report["adopted"] = _commit(output, names, drive, source, base, report)
        remove(parts)
    ended, ended_cpu = time.perf_counter(), time.process_time()
    seconds = sorted((task["seconds"] for task in tasks), reverse=True)
    return {
        **report,
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
    """The map that an update extends, as of its last flush."""

    map_id: str
    flush_number: int
    scan_number: int
    # Number of scans that the map's list of scans lacks, because updates do not list them. ``None`` if unknown.
    unlisted_scans: int | None
    tile_size: float
    keeps_scans: bool
    # Names of inputs, each with the number of scans before it.
    inputs: list[list[Any]]


# Record of the update that is being committed, so that it is not applied twice.
_COMMITTING = "adopting.json"

# Names of the files that calls leave in the folder of parts.
_OWN_NAMES = re.compile(
    r"(map_id|adopting)\.(json|new)|attempt-[0-9a-f]{32}(\.unfinished)?|[0-9a-f]{16}-(-?[0-9]+)-(-?[0-9]+)"
)


def _base(output: Path, settings: dict[str, Any]) -> _Base:
    report = describe(str(output))
    if settings.get("keep_scans") and not report["keeps_scans"]:
        raise ArgumentError("keep_scans: an update cannot begin to keep scans; build the map with it")
    settings["keep_scans"] = report["keeps_scans"]
    for name in ("resolution", "tile_size"):
        if settings.get(name, report[name]) != report[name]:
            raise ArgumentError(f"{name}: the map has {report[name]} m; leave this option out")
    scans, listed = report["scan_number"], report["scan_records"]
    unlisted = None if listed is None else scans - listed
    return _Base(
        map_id=str(report["map_id"]),
        flush_number=report["flush_number"],
        scan_number=scans,
        unlisted_scans=unlisted,
        tile_size=report["tile_size"],
        keeps_scans=report["keeps_scans"],
        inputs=[[input["name"], input["first_scan"]] for input in report["inputs"]],
    )


def _fingerprint(*what: object) -> str:
    identity = json.dumps([version("voxtile"), *what], sort_keys=True, default=str)
    return hashlib.sha256(identity.encode()).hexdigest()[:16]


def _write_json(path: Path, what: object) -> None:
    beside = path.with_suffix(".new")
    with open(beside, "w", encoding="utf-8") as file:
        json.dump(what, file)
        file.flush()
        os.fsync(file.fileno())
    os.replace(beside, path)


def _commit(
    output: Path, names: Sequence[str], drive: str, source: str, base: _Base, report: dict[str, Any]
) -> dict[str, Any]:
    note = Path(names[0]).parent / _COMMITTING
    _write_json(note, {"drive": drive, "map": asdict(base), "report": report})
    try:
        adopted: dict[str, Any] = replace_tiles(
            str(output),
            names,
            of_flush=base.flush_number,
            scans=report["scans"],
            input=os.path.basename(source) if base.keeps_scans else None,
        )
    except ArgumentError:
        # The map was changed by another process, and the update was not committed. After other errors this is unknown.
        note.unlink()
        raise
    return adopted


def _committed_before(parts: Path, drive: str, source: str, base: _Base) -> dict[str, Any] | None:
    """Returns the report of a call that committed these scans and was killed before it removed the parts."""
    try:
        noted: dict[str, Any] = json.loads((parts / _COMMITTING).read_text(encoding="utf-8"))
    except (FileNotFoundError, ValueError):
        return None
    before = _Base(**noted["map"])
    if noted["drive"] != drive or before.map_id != base.map_id or before.flush_number == base.flush_number:
        return None
    report: dict[str, Any] = noted["report"]
    if base.keeps_scans:
        # The update is an input of the map.
        return report if [os.path.basename(source), before.scan_number] in base.inputs else None
    # The flush number alone does not identify the update: another writer may have flushed scans. Those are in the list
    # of scans, unlike scans of updates.
    added = _difference(base.unlisted_scans, before.unlisted_scans)
    if added == report["scans"]:
        return report
    if added is not None and added <= 0:
        return None
    raise ArgumentError(
        f"{parts}: an earlier call ended while it committed {report['scans']} scans after scan {before.scan_number},"
        f" and {report['output']} has changed since; if the map lacks them, remove {parts} and call again"
    )


def _difference(number: int | None, other: int | None) -> int | None:
    return None if number is None or other is None else number - other


def _id_of(parts: Path) -> str:
    """Returns the id of the new map. All parts have it, including those of an earlier call."""
    note = parts / MAP_ID
    try:
        noted: str = json.loads(note.read_text(encoding="utf-8"))
    except (FileNotFoundError, ValueError):
        noted = uuid.uuid4().hex
        _write_json(note, noted)
    return noted


def _check_part(part: str) -> dict[str, Any]:
    """Verifies a part of an earlier call, which may have been damaged since."""
    done = verify(part)
    for finding in done["findings"]:
        if finding["severity"] == "damage":
            raise VoxtileError(f"{finding['path']}: {finding['reason']}; remove {part}, and call again to resume")
    return done


def _result(future: Any) -> dict[str, Any]:
    """Returns the result of a task. If its worker was lost, the error names it."""
    with losses.explained(use_less="use a smaller region_size or memory", then=_RESUME):
        done: dict[str, Any] = future.result()
    return done


# Advice after a loss.
_RESUME = "call again to resume: finished regions are kept"


def _check(output: Path, region_size: float, tile_size: float, options: Any, update: bool) -> None:
    # A column narrower than two tiles may contain no tile center.
    if not (math.isfinite(region_size) and region_size >= 2 * tile_size):
        raise ArgumentError(f"region_size: {region_size} m is less than two tiles of {tile_size} m; use a larger size")
    if not update and "resolution" not in options:
        raise ArgumentError("resolution: a new map needs it; pass the edge of a voxel in metres")
    if not update and output.exists():
        raise ArgumentError(f"{output}: already exists; choose another path, or remove it")
    allowed = {"resolution", *BuildOptions.__annotations__, *ReadOptions.__annotations__}
    for name in options:
        if name not in allowed:
            raise ArgumentError(f"{name}: not supported by a distributed build; use voxtile.build")
    for name, value in _UNSUPPORTED.items():
        if options.get(name, value) != value:
            raise ArgumentError(f"{name}: a distributed build uses all scans; leave it out, or use voxtile.build")


def _plan(client: Any, source: str, settings: dict[str, Any]) -> tuple[list[_ScanBox], float]:
    """Returns the fingerprint of each scan and the box that it may change (``None`` for no box), and the CPU seconds
    used.
    """
    reading = {name: value for name, value in settings.items() if name in ReadOptions.__annotations__}
    reach = (settings["max_range"], settings.get("clear_no_return"))
    # Scan streams are cheap to count. Other formats that store no number of scans would have to be read completely, so
    # they get one task.
    is_stream = source.lower().endswith(".scans")
    scans = files.count_scans(source, **reading) if is_stream else operator.length_hint(files.scans(source, **reading))
    workers = max(sum(client.nthreads().values()), 1)
    step = max(math.ceil(scans / (4 * workers)), 1)
    firsts = list(range(0, scans, step)) or [0]
    # The last task also takes scans beyond the estimate.
    spans = [(first, None if first == firsts[-1] else step) for first in firsts]
    tasks = [client.submit(_boxes, source, *span, reading, reach, pure=False, retries=2) for span in spans]
    with losses.explained(use_less="use workers with fewer threads", then=_RESUME):
        found = client.gather(tasks)
    return [scan for part, _ in found for scan in part], sum(cpu for _, cpu in found)


def _boxes(
    source: str,
    first: int,
    count: int | None,
    reading: dict[str, Any],
    reach: tuple[float | None, float | None],
) -> tuple[list[_ScanBox], float]:
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
    of_map: tuple[str, int] | None,
) -> dict[str, Any]:
    """Maps a column on the worker's disk, and moves it to its place as a shard of the map.

    ``sizes`` are the edges of a column and of a tile, ``of_map`` the map to update and its number of scans.
    """
    began, cpu_began = time.perf_counter(), time.process_time()
    with tempfile.TemporaryDirectory(prefix="voxtile-", dir=_dask.get_worker().local_directory) as local:
        made = os.path.join(local, "map")
        try:
            if of_map is not None:
                keeps: bool = settings["keep_scans"]
                crop(of_map[0], made, tiles_of(column, *sizes), shard_of=map_id, keep_scans=keeps)
            for first, last in ranges:
                options: dict[str, Any] = {**settings, "first": first, "count": last - first}
                # Ranges after the first append other scans of the same input.
                resume: dict[str, Any] = {"append": True, "again": True} if os.path.exists(made) else {}
                region = region_of(column, sizes[0])
                before = 0 if of_map is None else of_map[1]
                files.build_shard(source, made, map_id, before, region=region, **options, **resume)
            move_to_place(made, part, map_id)
        except VoxtileError as error:
            # Keep the class of the error and extend its message.
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
