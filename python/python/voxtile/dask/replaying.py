"""A replay of kept scans by many workers: each replays the affected tiles of some columns as a shard."""

from __future__ import annotations

import hashlib
import json
import os
import re
import tempfile
import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib.metadata import version
from pathlib import Path
from typing import Any

import distributed

from .._voxtile import describe, join, join_replay, replay_columns, replay_part, search_columns, verify
from ..errors import ArgumentError, VoxtileError
from . import losses
from .shards import locked, move_to_place, remove
from .simulation import advised_region_size

# The type hints of `distributed` are incomplete.
_dask: Any = distributed

# Names of the files that calls leave in the folder of parts: shards, maps joined of shards, results of searches, texts.
_OWN_NAMES = re.compile(
    r"attempt-[0-9a-f]{32}(\.unfinished)?|[0-9a-f]{16}-[a-z]+(\.unfinished)?"
    r"|[0-9a-f]{16}(-[a-z]+)?(-(-?[0-9]+)){2}(\.(json|new|result))?"
)

# A shard of a map that a search needs: the arguments are the map, column, edge of a column in tiles, and the output.
_MakeShard = Callable[[str, tuple[int, int], int, str, str], None]

# The results of searches have a file each, which bounds the number of their tasks.
_MAX_SEARCHES = 256


class Replaying:
    """A change of the scans of a map, with the finished parts of an earlier call of the same change."""

    def __init__(
        self,
        map: Path,
        parts: Path,
        client: Any,
        memory: int | str | None,
        region_size: float | None,
        progress: Callable[[int, int], object] | None,
    ) -> None:
        self.map, self.memory = str(map), memory
        self._parts, self._client, self._progress = parts, client, progress
        described = describe(self.map)
        self._map_id: str = described["map_id"]
        self._flush_number: int = described["flush_number"]
        tile_size: float = described["tile_size"]
        size = advised_region_size(described["max_range"], tile_size) if region_size is None else region_size
        if not size >= tile_size:
            raise ArgumentError(f"region_size: {size} m is less than a tile of {tile_size} m; use more")
        self._tiles = round(min(size / tile_size, 1e6))

    def search(self, name: str, task: Callable[..., str], last: int, *arguments: Any, key: Any) -> list[tuple[str, str]]:
        """Runs a task for each range of the scans up to number ``last``. Returns the file that each may have written,
        and its text. A task gets the map, the arguments, the first and the last scan, and the file.
        """
        step = max(-(-last // _MAX_SEARCHES), 1)
        ranges = [(first, min(first + step - 1, last)) for first in range(1, last + 1, step)]
        mark = self._mark(name, key)
        names = [self._parts / f"{mark}-{name}-{first}-{end}" for first, end in ranges]
        futures = [
            self._client.submit(_run_search, str(place), task, (self.map, *arguments, *scans), pure=False, retries=2)
            for place, scans in zip(names, ranges)
            if _read(place) is None
        ]
        self._run(futures, len(names) - len(futures), len(names))
        return [(f"{place}.result", _read(place) or "") for place in names]

    def make_map(self, kind: str, task: _MakeShard, columns: Sequence[tuple[int, int]], *, key: Any) -> str:
        """Makes a map of shards that tasks make, unless an earlier call has made it. Returns its path. A task gets the
        map, the column, the edge of a column in tiles, the output, and the id of the map to make.
        """
        mark = self._mark(kind, key)
        made = self._parts / f"{mark}-{kind}"
        if made.exists():
            return str(made)
        names = [self._parts / f"{mark}-{kind}-{x}-{y}" for x, y in columns or [(0, 0)]]
        futures = [
            self._client.submit(
                _make_shard,
                task,
                (self.map, column, self._tiles),
                str(name),
                mark * 2,
                pure=False,
                retries=2,
            )
            for name, column in zip(names, columns or [(0, 0)])
            if not name.exists()
        ]
        self._run(futures, len(names) - len(futures), len(names))
        join([str(name) for name in names], str(made))
        return str(made)

    def columns_of_scans(self) -> list[tuple[int, int]]:
        """The columns that scans reach."""
        return search_columns(self.map, self._tiles)

    def join(
        self, change: dict[str, Any], *, key: Any, keep_as: str | None, from_snapshots: bool = False
    ) -> dict[str, Any]:
        """Replays the columns that the change affects, and commits it. ``key`` identifies the change."""
        columns = replay_columns(self.map, change, self._tiles)
        mark = self._mark(key)
        names = [self._parts / f"{mark}-{x}-{y}" for x, y in columns]
        unfinished = {number for number, name in enumerate(names) if _read(name) is None}
        # A key of its own: an equal change of an earlier call may just be released.
        sent = self._client.scatter([change], broadcast=True, hash=False)[0] if unfinished else None
        futures = [
            self._client.submit(
                _replay_column,
                self.map,
                sent,
                columns[number],
                self._tiles,
                str(names[number]),
                self._map_id,
                self.memory,
                pure=False,
                retries=2,
            )
            for number in sorted(unfinished)
        ]
        checks = [
            self._client.submit(_check_shard, str(name), pure=False, retries=2)
            for number, name in enumerate(names)
            if number not in unfinished and name.exists()
        ]
        done_before = len(names) - len(unfinished)
        self._run(futures, done_before, len(names), checks)
        texts = [(str(name) if name.exists() else None, _read(name) or "") for name in names]
        report: dict[str, Any] = join_replay(
            self.map,
            change,
            texts,
            keep_as=keep_as,
            from_snapshots=from_snapshots,
            memory=self.memory,
            flush_number=self._flush_number,
        )
        return {**report, "parts": len(names), "parts_done_before": done_before}

    def _mark(self, *what: Any) -> str:
        state = [version("voxtile"), self._map_id, self._flush_number, self._tiles, *what]
        return hashlib.sha256(json.dumps(state, default=str).encode()).hexdigest()[:16]

    def _run(self, futures: Sequence[Any], done: int, total: int, checks: Sequence[Any] = ()) -> None:
        try:
            with losses.explained(use_less="use a smaller region_size or memory", then="call again to resume"):
                for future in _dask.as_completed(futures):
                    future.result()
                    done += 1
                    if self._progress is not None:
                        self._progress(done, total)
                self._client.gather(list(checks))
        finally:
            self._client.cancel([*futures, *checks])


@contextmanager
def replaying(
    map: str | os.PathLike[str],
    *,
    region_size: float | None,
    memory: int | str | None,
    client: Any,
    progress: Callable[[int, int], object] | None,
) -> Iterator[Replaying]:
    """Lets one process at a time change the scans of a map. Finished parts are kept after an error."""
    path = Path(os.path.abspath(map))
    parts = path.with_name(f"{path.name}.replay.parts")
    found: Any = _dask.Client.current() if client is None else client
    with locked(parts, _OWN_NAMES):
        yield Replaying(path, parts, found, memory, region_size, progress)
        remove(parts)


def _read(name: Path) -> str | None:
    """Returns the text of a finished part."""
    try:
        text = name.with_name(f"{name.name}.json").read_text(encoding="utf-8")
        json.loads(text)
    except (FileNotFoundError, ValueError):
        return None
    return text


def _write(name: str, text: str) -> None:
    """Writes the text of a part, which makes the part complete."""
    unfinished = f"{name}.new"
    with open(unfinished, "w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    os.replace(unfinished, f"{name}.json")


def _run_search(name: str, task: Callable[..., str], arguments: Sequence[Any]) -> None:
    # Another attempt may write at the same time.
    attempt = os.path.join(os.path.dirname(name), f"attempt-{uuid.uuid4().hex}")
    try:
        text = task(*arguments, attempt)
        if os.path.exists(attempt):
            os.replace(attempt, f"{name}.result")
    finally:
        with suppress(FileNotFoundError):
            os.unlink(attempt)
    _write(name, text)


def _make_shard(task: _MakeShard, arguments: tuple[str, tuple[int, int], int], name: str, map_id: str) -> None:
    with tempfile.TemporaryDirectory(prefix="voxtile-", dir=_dask.get_worker().local_directory) as local:
        made = os.path.join(local, "map")
        task(*arguments, made, map_id)
        move_to_place(made, name, map_id)


def _replay_column(
    map: str,
    change: dict[str, Any],
    column: tuple[int, int],
    tiles: int,
    name: str,
    map_id: str,
    memory: int | str | None,
) -> None:
    with tempfile.TemporaryDirectory(prefix="voxtile-", dir=_dask.get_worker().local_directory) as local:
        made = os.path.join(local, "map")
        text = replay_part(map, change, column, tiles, made, memory=memory)
        if os.path.exists(made):
            move_to_place(made, name, map_id)
    _write(name, text)


def _check_shard(name: str) -> None:
    """Verifies a shard of an earlier call, which may have been damaged since."""
    for finding in verify(name)["findings"]:
        if finding["severity"] == "damage":
            raise VoxtileError(f"{finding['path']}: {finding['reason']}; remove {name} and {name}.json, and call again")
