"""Regions of a distributed build: columns of tiles, and the scans that reach each of them.

Lengths are in metres, boxes are west, south, east, north.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from ..errors import ArgumentError

Box = tuple[float, float, float, float]
Column = tuple[int, int]
# The first scan, and the one after the last.
Range = tuple[int, int]

# Two visits of a column are read as one range if there are at most this many scans between them. These scans change
# nothing there, but reading them takes no longer than reopening the map for a second range.
JOINED_GAP_SCANS = 20


def columns_of(
    boxes: Sequence[Box | None],
    size: float,
    tile_size: float,
    joined_gap: int = JOINED_GAP_SCANS,
    most: float = math.inf,
) -> dict[Column, list[Range]]:
    """Returns the columns that scans may reach, each with its ranges of scans in order.

    If a drive returns to a column, the scans in between are skipped if they are more than ``joined_gap``. Raises
    an error for more than ``most`` columns.
    """
    columns: dict[Column, list[Range]] = {}
    for number, box in enumerate(boxes):
        if box is None:
            continue
        for column in reached(box, size, tile_size):
            ranges = columns.setdefault(column, [])
            if len(columns) > most:
                raise ArgumentError(
                    f"scan {number}: with it, scans reach more than {most} regions of {size} m; check its pose and"
                    " points, or use a smaller max_range or clear_no_return, or a larger region_size"
                )
            if ranges and number - ranges[-1][1] <= joined_gap:
                ranges[-1] = (ranges[-1][0], number + 1)
            else:
                ranges.append((number, number + 1))
    return columns


def with_unreached(columns: dict[Column, list[Range]], boxes: Sequence[Box | None]) -> dict[Column, list[Range]]:
    """Returns the columns with all scans that reach none of them as scans of the first one, which keeps them."""
    if not columns:
        return columns
    first = min(columns)
    own = [number for low, end in columns[first] for number in range(low, end)]
    unreached = [number for number, box in enumerate(boxes) if box is None]
    ranges: list[Range] = []
    for number in sorted({*own, *unreached}):
        if ranges and ranges[-1][1] == number:
            ranges[-1] = (ranges[-1][0], number + 1)
        else:
            ranges.append((number, number + 1))
    return {**columns, first: ranges}


def reached(box: Box, size: float, tile_size: float) -> Iterator[Column]:
    """Yields the columns that may contain the center of a tile that the box touches."""
    west, south, east, north = box
    # A tile extends half of its edge beyond its center; the other half is slack for rounding.
    margin = tile_size
    return (
        (x, y)
        for x in range(math.floor((west - margin) / size), math.floor((east + margin) / size) + 1)
        for y in range(math.floor((south - margin) / size), math.floor((north + margin) / size) + 1)
    )


def region_of(column: Column, size: float) -> list[float]:
    """Returns the half-open box of a column, as ``voxtile.build`` takes it: low x, y, z and high x, y, z."""
    x, y = column
    return [x * size, y * size, -math.inf, (x + 1) * size, (y + 1) * size, math.inf]


def tiles_of(column: Column, size: float, tile_size: float) -> list[float]:
    """Returns the box of the whole tiles whose centers are in a column, as ``voxtile.crop`` takes it."""
    x, y = column
    low, high = (
        [_first_tile(number, size, tile_size) * tile_size for number in corner] for corner in ((x, y), (x + 1, y + 1))
    )
    return [*low, -math.inf, *high, math.inf]


def column_of(tile: tuple[int, int], size: float, tile_size: float) -> Column:
    """Returns the column that contains the center of a tile."""
    x, y = (_column_along_axis(number, size, tile_size) for number in tile)
    return x, y


def _first_tile(column: int, size: float, tile_size: float) -> int:
    """Returns the first tile of a column along an axis, rounded as in ``voxtile.build``."""
    return math.ceil(column * size / tile_size - 0.5)


def _column_along_axis(tile: int, size: float, tile_size: float) -> int:
    # The division rounds differently from `_first_tile`, so a center on a border may get the next column.
    column = math.floor((tile + 0.5) * tile_size / size)
    while tile < _first_tile(column, size, tile_size):
        column -= 1
    while tile >= _first_tile(column + 1, size, tile_size):
        column += 1
    return column


def scans_in(ranges: Sequence[Range]) -> int:
    return sum(last - first for first, last in ranges)
