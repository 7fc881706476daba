from collections.abc import Callable, Iterable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from subprocess import Popen
from types import TracebackType
from typing import Any, ClassVar, Literal, NoReturn, TypeAlias, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "Change",
    "Comparison",
    "DistanceField",
    "Frontier",
    "InsertReport",
    "LocalMap",
    "Map",
    "ScanIterator",
    "TileIterator",
    "replace_tiles",
    "call_build",
    "call_export",
    "call_export_scans",
    "check_replay",
    "class_style",
    "clean",
    "clear",
    "color_map",
    "compare",
    "compare_part",
    "compute_distances",
    "convert",
    "count_scans",
    "crop",
    "decay",
    "default_tile_size",
    "delete_snapshot",
    "describe",
    "diff",
    "forget_old",
    "import_octree",
    "join",
    "join_parts",
    "join_replay",
    "map_for_search",
    "merge",
    "move_shard",
    "open_scans",
    "remap",
    "remap_as",
    "remove_points",
    "remove_scans",
    "scan_digest",
    "repair",
    "replay_columns",
    "replay_part",
    "revert",
    "run_command",
    "scan_reaches",
    "search_columns",
    "search_moving",
    "search_points",
    "snapshots",
    "verify",
    "wait_for_all",
]

_Path: TypeAlias = str | PathLike[str]
_Paths: TypeAlias = _Path | Sequence[_Path]
_MapOrSnapshot: TypeAlias = _Path | tuple[_Path, str]
_Progress: TypeAlias = Callable[[int, int], object]
_Pose: TypeAlias = ArrayLike | tuple[ArrayLike, ArrayLike]
_Scan: TypeAlias = tuple[ArrayLike, _Pose] | tuple[ArrayLike, _Pose, ArrayLike | None]
_Unknown: TypeAlias = Literal["free", "obstacle"]
_UnknownRule: TypeAlias = Literal["unknown", "free", "obstacle"]
_Storage: TypeAlias = Literal["octomap", "compact"]
_InsertMode: TypeAlias = Literal["per-scan", "per-ray"]
_Clearing: TypeAlias = Literal["octomap", "guarded"]
_SensorModel: TypeAlias = Literal["log-odds", "iwlo"]
_Probabilities: TypeAlias = Sequence[float]

@final
class InsertReport:
    @property
    def points(self) -> int: ...
    @property
    def skipped(self) -> int: ...
    @property
    def not_finite(self) -> int: ...
    @property
    def out_of_range(self) -> int: ...
    @property
    def no_return(self) -> int: ...
    @property
    def too_near(self) -> int: ...
    @property
    def ray_too_long(self) -> int: ...
    @property
    def no_intensity(self) -> int: ...
    @property
    def cut_at_max_range(self) -> int: ...
    @property
    def hits(self) -> int: ...
    @property
    def misses(self) -> int: ...
    @property
    def tiles_touched(self) -> int: ...
    def __eq__(self, value: object, /) -> bool: ...
    def __ne__(self, value: object, /) -> bool: ...

@final
class LocalMap:
    def __new__(
        cls,
        resolution: float = 0.1,
        *,
        preset: Literal["local-mapping", "autonomous-mapping", "passive-perception"] = "local-mapping",
        max_voxels: int | None = None,
        min_range: float | None = None,
        max_range: float | None = None,
        inflation_range: float | None = None,
        inflation_radius: float | None = None,
    ) -> LocalMap: ...
    @property
    def position(self) -> list[float] | None: ...
    @property
    def resolution(self) -> float: ...
    @property
    def updates(self) -> int: ...
    def insert(
        self, points: ArrayLike, pose: _Pose | None = None, *, origin: ArrayLike | None = None
    ) -> dict[str, Any]: ...
    def state(self, points: ArrayLike) -> NDArray[np.int8]: ...
    def occupied(self) -> NDArray[np.float64]: ...
    def inflated(self) -> NDArray[np.float64]: ...
    def collides(self, boxes: ArrayLike, *, inflated: bool = True) -> NDArray[np.bool_]: ...

@final
class DistanceField:
    @staticmethod
    def open(folder: _Path, *, memory: int | str | None = None) -> DistanceField: ...
    @property
    def resolution(self) -> float: ...
    @property
    def max_distance(self) -> float: ...
    @property
    def unknown(self) -> _UnknownRule: ...
    @property
    def signed(self) -> bool: ...
    @property
    def bounds(self) -> NDArray[np.float64] | None: ...
    def at(self, points: ArrayLike) -> NDArray[np.float64]: ...
    def at_with_gradient(self, points: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
    def clearance_along(self, path: ArrayLike, radius: float) -> dict[str, Any]: ...
    def to_dense(
        self, region: ArrayLike | None = None, values: Literal["metres", "squared_voxels"] = "metres"
    ) -> tuple[NDArray[Any], NDArray[np.float64]]: ...

@final
class Change:
    @property
    def number(self) -> int: ...
    @property
    def kind(self) -> Literal["vanished", "appeared"]: ...
    @property
    def voxels(self) -> int: ...
    @property
    def volume_m3(self) -> float: ...
    @property
    def bounds(self) -> NDArray[np.float64]: ...
    @property
    def center(self) -> NDArray[np.float64]: ...
    @property
    def colour(self) -> tuple[int, int, int] | None: ...
    @property
    def class_(self) -> int | None: ...
    @property
    def first_ns(self) -> int | None: ...
    @property
    def last_ns(self) -> int | None: ...

@final
class Comparison:
    CLASSES: ClassVar[dict[str, int]]
    @property
    def counts(self) -> dict[str, dict[str, float]]: ...
    @property
    def changes(self) -> list[Change]: ...
    @property
    def warnings(self) -> list[str]: ...
    @property
    def resolution(self) -> float: ...
    def voxels(self, change: int | None = None) -> tuple[NDArray[np.float64], NDArray[np.uint8]]: ...
    def to_dict(self) -> dict[str, Any]: ...
    def to_geojson(self) -> dict[str, Any]: ...
    def _repr_html_(self) -> str: ...

@final
class Frontier:
    @property
    def number(self) -> int: ...
    @property
    def voxels(self) -> int: ...
    @property
    def area_m2(self) -> float: ...
    @property
    def bounds(self) -> NDArray[np.float64]: ...
    @property
    def center(self) -> NDArray[np.float64]: ...
    @property
    def goal(self) -> NDArray[np.float64]: ...

@final
class Map:
    @staticmethod
    def create(
        path: _Path,
        resolution: float = 0.1,
        *,
        tile_size: float | None = None,
        min_range: float = 0.0,
        max_range: float | None = None,
        insert_mode: _InsertMode = "per-scan",
        clearing: _Clearing = "octomap",
        sensor_model: _SensorModel = "log-odds",
        probabilities: _Probabilities | None = None,
        occupancy_threshold: float = 0.5,
        storage: _Storage = "octomap",
        memory: int | str | None = None,
        keep_scans: bool = False,
        layers: str | Sequence[str] | None = None,
    ) -> Map: ...
    @staticmethod
    def open(
        path: _Path,
        mode: Literal["r", "r+"] = "r+",
        *,
        snapshot: str | None = None,
        memory: int | str | None = None,
    ) -> Map: ...
    @property
    def path(self) -> Path: ...
    @property
    def resolution(self) -> float: ...
    @property
    def tile_size(self) -> float: ...
    @property
    def occupancy_threshold(self) -> float: ...
    @property
    def closed(self) -> bool: ...
    @property
    def writable(self) -> bool: ...
    @property
    def scan_number(self) -> int: ...
    @property
    def bounds(self) -> NDArray[np.float64] | None: ...
    @property
    def tiles(self) -> NDArray[np.int32]: ...
    def insert(
        self,
        points: ArrayLike,
        pose: _Pose | None = None,
        *,
        origin: ArrayLike | None = None,
        intensities: ArrayLike | None = None,
        colours: ArrayLike | None = None,
        classes: ArrayLike | None = None,
    ) -> InsertReport: ...
    def insert_many(self, scans: Iterable[_Scan]) -> InsertReport: ...
    def flush(self, *, wait: bool = True) -> None: ...
    @property
    def flushed_scan_number(self) -> int: ...
    def close(self, *, flush: bool = True) -> None: ...
    def __enter__(self) -> Map: ...
    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> Literal[False]: ...
    def refresh(self) -> bool: ...
    def snapshot(self, name: str) -> None: ...
    def statistics(self) -> dict[str, Any]: ...
    @property
    def layers(self) -> list[str]: ...
    def layers_at(self, points: ArrayLike) -> dict[str, NDArray[Any]]: ...
    def layer_digest(self) -> str: ...
    def occupancy(self, points: ArrayLike) -> NDArray[np.int8]: ...
    def probability(self, points: ArrayLike) -> NDArray[np.float64]: ...
    def log_odds(self, points: ArrayLike) -> NDArray[np.float64]: ...
    def counts(self, points: ArrayLike) -> NDArray[np.int32]: ...
    def cast_rays(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        *,
        max_range: float | None = None,
        unknown: _Unknown = "free",
    ) -> tuple[NDArray[np.float64], NDArray[np.int32]]: ...
    def nearest(
        self, points: ArrayLike, max_distance: float = 10.0
    ) -> tuple[NDArray[np.int32], NDArray[np.float64], NDArray[np.float64]]: ...
    def collides(self, boxes: ArrayLike, *, unknown: _Unknown = "free") -> NDArray[np.bool_]: ...
    def occupied(
        self, region: ArrayLike | None = None, min_probability: float | None = None
    ) -> tuple[NDArray[np.float64], NDArray[np.float32]]: ...
    def occupied_by_tile(self, min_probability: float | None = None) -> TileIterator: ...
    def to_dense(
        self, region: ArrayLike, values: Literal["occupancy", "probability", "log_odds"] = "occupancy"
    ) -> tuple[NDArray[Any], NDArray[np.float64]]: ...
    def distance_field(
        self,
        region: ArrayLike,
        *,
        max_distance: float = 5.0,
        unknown: _UnknownRule = "unknown",
        signed: bool = False,
    ) -> DistanceField: ...
    def frontiers(
        self, region: ArrayLike | None = None, *, min_area: float = 0.0, min_voxels: int = 8
    ) -> list[Frontier]: ...
    def digest(self) -> str: ...
    def _ceiling(self) -> float | None: ...
    def plot(self, **options: Any) -> Any: ...
    def view(self) -> Popen[bytes]: ...
    def _repr_html_(self) -> str: ...
    def __reduce__(self) -> NoReturn: ...

@final
class TileIterator:
    def __iter__(self) -> TileIterator: ...
    def __next__(self) -> tuple[tuple[int, int, int], NDArray[np.float64], NDArray[np.float32]]: ...

@final
class ScanIterator:
    def __iter__(self) -> ScanIterator: ...
    def __next__(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float32] | None]: ...
    def __length_hint__(self) -> int: ...
    @property
    def moving(self) -> NDArray[np.bool_] | None: ...

def count_scans(path: _Paths, options: Mapping[str, Any]) -> int: ...
def open_scans(path: _Paths, options: Mapping[str, Any]) -> ScanIterator: ...
def scan_reaches(
    path: _Paths, options: Mapping[str, Any], *, max_range: float | None = None, no_return_range: float | None = None
) -> list[tuple[str, tuple[float, float, float, float] | None]]: ...
def call_build(
    scans: _Paths,
    output: _Path,
    options: Mapping[str, Any],
    progress: _Progress | None = None,
    *,
    shard_of: str | None = None,
    scans_before: int = 0,
) -> dict[str, Any]: ...
def call_export(
    map: _Path, output: _Path, options: Mapping[str, Any], progress: _Progress | None = None
) -> dict[str, Any]: ...
def call_export_scans(
    map: _Path, folder: _Path, only_moving: bool = False, progress: _Progress | None = None
) -> dict[str, Any]: ...
def snapshots(map: _Path) -> list[dict[str, Any]]: ...
def delete_snapshot(map: _Path, name: str) -> None: ...
def diff(first: _MapOrSnapshot, second: _MapOrSnapshot, *, progress: _Progress | None = None) -> dict[str, Any]: ...
def revert(
    map: _Path, name: str, *, keep_as: str | None = None, progress: _Progress | None = None
) -> dict[str, Any]: ...
def remap(
    map: _Path,
    poses: Mapping[int, _Pose] | Iterable[_Pose],
    *,
    tolerance: tuple[float, float] | None = None,
    keep_as: str | None = None,
    dry_run: bool = False,
    interpolate: bool = False,
    memory: int | str | None = None,
    progress: _Progress | None = None,
) -> dict[str, Any]: ...
def replay_columns(map: _Path, change: dict[str, Any], tiles: int) -> list[tuple[int, int]]: ...
def replay_part(
    map: _Path,
    change: dict[str, Any],
    column: tuple[int, int],
    tiles: int,
    output: _Path,
    *,
    memory: int | str | None = None,
) -> str: ...
def join_replay(
    map: _Path,
    change: dict[str, Any],
    parts: Sequence[tuple[_Path | None, str]],
    *,
    keep_as: str | None = None,
    from_snapshots: bool = False,
    memory: int | str | None = None,
    flush_number: int | None = None,
) -> dict[str, Any]: ...
def search_points(map: _Path, region: ArrayLike, first: int, last: int) -> str: ...
def check_replay(
    map: _Path, *, keep_as: str | None = None, memory: int | str | None = None
) -> tuple[int, int, bool]: ...
def search_columns(map: _Path, tiles: int) -> list[tuple[int, int]]: ...
def map_for_search(
    map: _Path,
    kind: Literal["reversed", "unmarked", "counts"],
    column: tuple[int, int],
    tiles: int,
    output: _Path,
    *,
    shard_of: str,
    maps: tuple[_Path, _Path | None, _Path | None] | None = None,
    memory: int | str | None = None,
) -> None: ...
def search_moving(
    map: _Path,
    maps: tuple[_Path, _Path | None, _Path | None],
    first: int,
    last: int,
    output: _Path,
    *,
    region: ArrayLike | None = None,
    parked_scans: int | None = None,
    memory: int | str | None = None,
) -> str: ...
def class_style(number: int, /) -> tuple[str, tuple[int, int, int]]: ...
def color_map(name: str, /) -> list[tuple[int, int, int]]: ...
def clean(
    map: _Path,
    *,
    undo: bool = False,
    region: ArrayLike | None = None,
    parked_scans: int | None = None,
    keep_as: str | None = None,
    dry_run: bool = False,
    memory: int | str | None = None,
    progress: _Progress | None = None,
) -> dict[str, Any]: ...
def compare(
    before: Map | _MapOrSnapshot,
    after: Map | _MapOrSnapshot,
    *,
    tolerance: float | None = None,
    certainty: float = 0.7,
    min_voxels: int = 8,
    region: ArrayLike | None = None,
    positions: tuple[ArrayLike | None, ArrayLike | None] | None = None,
    memory: int | str | None = None,
    progress: _Progress | None = None,
) -> Comparison: ...
def compare_part(
    before: _MapOrSnapshot, after: _MapOrSnapshot, part: int, parts: int, options: Mapping[str, Any]
) -> bytes: ...
def join_parts(
    before: _MapOrSnapshot, after: _MapOrSnapshot, parts: Sequence[bytes], options: Mapping[str, Any]
) -> Comparison: ...
def compute_distances(
    map: _MapOrSnapshot,
    folder: _Path,
    *,
    max_distance: float = 5.0,
    unknown: _UnknownRule = "unknown",
    signed: bool = False,
    region: ArrayLike | None = None,
    memory: int | str | None = None,
    progress: _Progress | None = None,
) -> dict[str, Any]: ...
def remap_as(
    map: _MapOrSnapshot,
    output: _Path,
    *,
    resolution: float | None = None,
    tile_size: float | None = None,
    min_range: float | None = None,
    max_range: float | None = None,
    insert_mode: _InsertMode | None = None,
    clearing: _Clearing | None = None,
    layers: str | Sequence[str] | None = None,
    storage: _Storage | None = None,
    keep_scans: bool = False,
    memory: int | str | None = None,
    progress: _Progress | None = None,
) -> dict[str, Any]: ...
def remove_scans(
    map: _Path,
    *,
    scans: tuple[int, int] | None = None,
    time: tuple[int, int] | None = None,
    input: str | None = None,
    from_snapshots: bool = False,
    keep_as: str | None = None,
    dry_run: bool = False,
    memory: int | str | None = None,
    progress: _Progress | None = None,
) -> dict[str, Any]: ...
def remove_points(
    map: _Path,
    region: ArrayLike,
    *,
    keep_as: str | None = None,
    dry_run: bool = False,
    memory: int | str | None = None,
    progress: _Progress | None = None,
) -> dict[str, Any]: ...
def merge(
    maps: Sequence[_MapOrSnapshot],
    output: _Path,
    *,
    prefer: Literal["first", "last", "more-observed"] | None = None,
    progress: _Progress | None = None,
) -> dict[str, Any]: ...
def move_shard(
    map: _Path, output: _Path, map_id: str, *, progress: _Progress | None = None
) -> dict[str, Any]: ...
def scan_digest(map: _MapOrSnapshot) -> str: ...
def join(shards: Sequence[_Path], output: _Path, *, progress: _Progress | None = None) -> dict[str, Any]: ...
def replace_tiles(
    map: _Path,
    parts: Sequence[_Path],
    *,
    of_flush: int,
    scans: int,
    input: str | None = None,
    progress: _Progress | None = None,
) -> dict[str, Any]: ...
def default_tile_size(resolution: float) -> float: ...
def describe(map: _MapOrSnapshot) -> dict[str, Any]: ...
def crop(
    map: _MapOrSnapshot,
    output: _Path,
    region: ArrayLike | None = None,
    *,
    polygon: _Path | None = None,
    z: tuple[float, float] | None = None,
    outside: bool = False,
    keep_scans: bool = False,
    shard_of: str | None = None,
    progress: _Progress | None = None,
) -> dict[str, Any]: ...
def convert(
    map: _MapOrSnapshot,
    output: _Path,
    storage: _Storage,
    *,
    keep_scans: bool = True,
    progress: _Progress | None = None,
) -> dict[str, Any]: ...
def import_octree(
    file: _Path, output: _Path, *, storage: _Storage = "octomap", progress: _Progress | None = None
) -> dict[str, Any]: ...
def clear(
    map: _Path, region: ArrayLike, *, outside: bool = False, progress: _Progress | None = None
) -> dict[str, Any]: ...
def decay(
    map: _Path,
    halflife_scans: float,
    *,
    scans: int | None = None,
    forget_below: float = 0.0,
    progress: _Progress | None = None,
) -> dict[str, Any]: ...
def forget_old(
    map: _Path,
    seconds: float,
    *,
    now_ns: int | None = None,
    progress: _Progress | None = None,
) -> dict[str, Any]: ...
def verify(
    map: _Path,
    *,
    tiles: Sequence[tuple[int, int, int]] | None = None,
    but_tiles: bool = False,
    progress: _Progress | None = None,
) -> dict[str, Any]: ...
def repair(map: _Path, *, progress: _Progress | None = None) -> dict[str, Any]: ...
def run_command(arguments: Sequence[str]) -> None: ...
def wait_for_all() -> None: ...
