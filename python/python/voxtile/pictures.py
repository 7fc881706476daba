"""Pictures of maps: matplotlib figures, a summary for notebooks, the viewer."""

from __future__ import annotations

import base64
import functools
import html
import io
import os
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ._voxtile import Comparison, Map, class_style, color_map as stops_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap
    from matplotlib.figure import Figure

_MOST_PIXELS = 2048
# Changes in the table of a notebook.
_MOST_CHANGES = 10
# Layers by the names of colors, as in `voxtile picture --color`.
_LAYERS = {"rgb": "colour", "intensity": "intensity", "class": "class", "age": "time"}
_NO_VALUE = (92, 98, 108)
# Nanoseconds since 1970 from 2000 to 2100; other time stamps count from another epoch.
_UNIX_TIMES_NS = (946_684_800 * 10**9, 4_102_444_800 * 10**9)


class _Columns:
    """The highest occupied voxel of each column of voxels, as an array of rows (y) and columns (x).

    An element is a whole voxel, or several if an edge would exceed ``max_pixels``. Uses the memory of one tile and of the
    picture.
    """

    def __init__(
        self,
        map: Map,
        region: Any,
        min_probability: float | None,
        max_pixels: int,
        max_height: float | None = None,
    ) -> None:
        self.map = map
        self.extent = (0.0, 1.0, 0.0, 1.0)
        self.tops = np.full((1, 1, 3), np.nan)
        bounds = map.bounds if region is None else np.asarray(region, np.float64).reshape(2, 3)
        if bounds is None:
            return
        low, high = bounds
        edge = map.resolution * max(1, int(np.ceil((high - low)[:2].max() / map.resolution / max_pixels)))
        columns, rows = np.maximum(1, np.ceil((high - low)[:2] / edge - 1e-9)).astype(int)
        tops = np.full((rows * columns, 3), -np.inf)
        for _, centers, _ in map.occupied_by_tile(min_probability):
            inside = centers[((low <= centers) & (centers < high)).all(axis=1)]
            if max_height is not None:
                inside = inside[inside[:, 2] < max_height]
            at = np.floor((inside[:, :2] - low[:2]) / edge).astype(int)
            at = np.minimum(at[:, 1], rows - 1) * columns + np.minimum(at[:, 0], columns - 1)
            # The last one of an element is the highest.
            order = np.argsort(inside[:, 2], kind="stable")
            inside, at = inside[order], at[order]
            higher = inside[:, 2] > tops[at, 2]
            tops[at[higher]] = inside[higher]
        tops[np.isinf(tops[:, 2])] = np.nan
        self.tops = tops.reshape(rows, columns, 3)
        self.extent = (float(low[0]), float(low[0] + columns * edge), float(low[1]), float(low[1] + rows * edge))

    @property
    def heights(self) -> NDArray[np.float64]:
        """Heights in metres; NaN for columns without an occupied voxel."""
        return self.tops[:, :, 2]

    def layer(self, name: str) -> NDArray[Any]:
        """Values of a layer, with an element for each one of ``known``."""
        return self.map.layers_at(self.tops[self.known])[name]

    @property
    def known(self) -> NDArray[np.bool_]:
        """Whether a column has an occupied voxel."""
        return ~np.isnan(self.heights)

    def image(self, colors: NDArray[Any]) -> NDArray[np.uint8]:
        """Returns an opaque image of colors of the known elements; NaN becomes grey, unknown elements are white."""
        image = np.full((*self.known.shape, 3), 255, np.uint8)
        colors = np.where(np.isnan(colors), _NO_VALUE, colors)
        image[self.known] = np.round(colors).astype(np.uint8)
        return image

    def values(self, values: NDArray[Any]) -> NDArray[np.float64]:
        """Returns an array of values of the known elements; NaN elsewhere."""
        array = np.full(self.known.shape, np.nan)
        array[self.known] = values
        return array


def heights(
    map: Map,
    region: Any = None,
    min_probability: float | None = None,
    max_pixels: int = _MOST_PIXELS,
) -> tuple[NDArray[np.float64], tuple[float, float, float, float]]:
    """Heights of the highest occupied voxel of each column, in metres; NaN for columns without one.

    Returns an array of rows (y) and columns (x), and its extent: left, right, bottom, top. A column of the array is
    a whole voxel, or several if an edge would exceed ``max_pixels``. Uses the memory of one tile and of the picture.
    """
    columns = _Columns(map, region, min_probability, max_pixels)
    return columns.heights, columns.extent


def plot(
    map: Map,
    *,
    color: str = "height",
    color_map: str = "voxtile",
    max_height: float | str | None = "auto",
    region: Any = None,
    min_probability: float | None = None,
    ax: Axes | None = None,
) -> Figure:
    """Draws the map from above: the highest occupied voxel of each column.

    ``color`` is ``"height"`` in metres, or a layer of the map: ``"rgb"``, ``"intensity"``, ``"class"``, or ``"age"`` (the
    time of the last hit). ``color_map`` has the colors of values: a name of ``voxtile picture --color-map``, or one of
    matplotlib. Only voxels below ``max_height`` in metres are drawn; ``"auto"`` cuts the ceiling of rooms, at the height of
    the sensor, if most columns around the trajectory are roofed and there is no ``region``. ``region`` is a box, lower and upper corner; ``ax`` are
    axes to draw into. Needs matplotlib. Returns the figure. A notebook shows it as the result of a cell, or with
    ``display``; in a program, ``savefig`` writes it.
    """
    from matplotlib.figure import Figure as NewFigure
    from matplotlib.patches import Patch

    if color != "height":
        name = _LAYERS.get(color)
        if name is None:
            raise ValueError(f"color: {color!r} is none of height, {', '.join(_LAYERS)}")
        if name not in map.layers:
            raise ValueError(f"color: {color!r} needs the layer {name}; build a map with layers={name!r}")
    if isinstance(max_height, str) and max_height != "auto":
        raise ValueError(f"max_height: {max_height!r} is not auto, None, or a height in metres")
    colors_of_values = _color_map(color_map)
    if isinstance(max_height, str):
        cut = map._ceiling() if region is None else None
    else:
        cut = max_height
    columns = _Columns(map, region, min_probability, _MOST_PIXELS, cut)
    figure = NewFigure(figsize=(8, 6)) if ax is None else ax.figure
    axes = figure.add_subplot() if ax is None else ax
    draw = functools.partial(axes.imshow, origin="lower", extent=columns.extent, interpolation="nearest")
    if color == "rgb":
        draw(columns.image(columns.layer("colour")))
    elif color == "class":
        classes = columns.layer("class")
        colors = np.full((len(classes), 3), np.nan)
        patches = []
        for number in np.unique(classes[classes >= 0]).tolist():
            label, style = class_style(number)
            colors[classes == number] = style
            patches.append(Patch(color=np.divide(style, 255).tolist(), label=label))
        draw(columns.image(colors))
        if patches:
            axes.legend(handles=patches, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    else:
        values, label, ends = _scale(columns, color)
        image = draw(values, cmap=colors_of_values, vmin=ends[0], vmax=ends[1])
        figure.colorbar(image, ax=axes, label=label)
    if cut is not None and max_height == "auto":
        axes.set_title(f"ceiling cut at {cut:.2f} m, the height of the sensor", fontsize="medium")
    axes.set_xlabel("x in m")
    axes.set_ylabel("y in m")
    axes.set_aspect("equal")
    whole: Figure = axes.get_figure(root=True)  # type: ignore[assignment]
    if ax is None:
        # Notebooks show figures by themselves only after pyplot was imported.
        setattr(whole, "_repr_png_", functools.partial(_png_of, whole))
    return whole


def _color_map(name: str) -> Colormap:
    """Returns a color map of voxtile, or of matplotlib if voxtile has none of this name."""
    from matplotlib import colormaps
    from matplotlib.colors import LinearSegmentedColormap

    try:
        stops = np.divide(stops_of(name), 255)
    except ValueError:
        if name in colormaps:
            return colormaps[name]
        raise
    return LinearSegmentedColormap.from_list(name, stops.tolist())


def _scale(columns: _Columns, color: str) -> tuple[NDArray[np.float64], str, tuple[float | None, float | None]]:
    """Returns values, their name, and the ends of the scale."""
    if color in ("height", "intensity"):
        values = columns.heights if color == "height" else columns.values(columns.layer("intensity"))
        known = values[~np.isnan(values)]
        low, high = np.percentile(known, [2, 98]) if len(known) else (0.0, 1.0)
        return values, "height in m" if color == "height" else color, (float(low), float(high))
    last_ns = columns.layer("last_ns")
    is_known = last_ns > np.iinfo(np.int64).min
    first_ns = int(last_ns[is_known].min()) if is_known.any() else 0
    # The difference of integers is exact; times since 1970 as floats are not.
    seconds = np.where(is_known, (last_ns - first_ns) * 1e-9, np.nan)
    since = "the first"
    if _UNIX_TIMES_NS[0] <= first_ns < _UNIX_TIMES_NS[1]:
        since = str(np.datetime64(first_ns, "ns").astype("datetime64[s]")).replace("T", " ") + " UTC"
    return columns.values(seconds), f"last hit in s after {since}", (None, None)


def _png_of(figure: Figure) -> bytes:
    png = io.BytesIO()
    figure.savefig(png, format="png", bbox_inches="tight")
    return png.getvalue()


def summary_html(map: Map) -> str:
    """Returns the summary of a map that notebooks show, with a small picture if matplotlib is installed."""
    if map.closed:
        return f"<p><b>voxtile map</b> {html.escape(str(map.path))}, closed</p>"
    cells = {
        "path": html.escape(str(map.path)),
        "resolution": f"{map.resolution:g} m",
        "tiles": f"{len(map.tiles)} of {map.tile_size:g} m",
        "scans": str(map.scan_number),
    }
    rows = "".join(f"<tr><th>{name}</th><td>{value}</td></tr>" for name, value in cells.items())
    return f"<p><b>voxtile map</b></p><table>{rows}</table>{_picture_html(map)}"


def comparison_html(comparison: Comparison) -> str:
    """Returns the tables of a comparison that notebooks show: the counts, and the largest changes."""
    counts = [
        [name.replace("_", " "), str(count["voxels"]), f"{count['volume_m3']:.3g}"]
        for name, count in comparison.counts.items()
    ]
    changes = []
    for change in comparison.changes[:_MOST_CHANGES]:
        center, size = change.center, change.bounds[1] - change.bounds[0]
        place = " ".join(f"{k:.2f}" for k in center)
        edges = " x ".join(f"{k:.2f}" for k in size)
        changes.append([str(change.number), change.kind, str(change.voxels), place, edges])
    tables = _table_html(["class", "voxels", "m3"], counts)
    tables += _table_html(["change", "kind", "voxels", "center in m", "size in m"], changes)
    rest = len(comparison.changes) - len(changes)
    remarks = ([f"and {rest} more changes"] if rest else []) + comparison.warnings
    return f"<p><b>voxtile comparison</b></p>{tables}" + "".join(f"<p>{html.escape(line)}</p>" for line in remarks)


def _table_html(head: list[str], rows: list[list[str]]) -> str:
    if not rows:
        return ""
    cells = "".join(f"<th>{name}</th>" for name in head)
    lines = ("".join(f"<td>{value}</td>" for value in row) for row in rows)
    return f"<table><tr>{cells}</tr>{''.join(f'<tr>{line}</tr>' for line in lines)}</table>"


def _picture_html(map: Map) -> str:
    try:
        from matplotlib.image import imsave
    except ImportError:
        return ""
    columns = _Columns(map, None, None, 256, map._ceiling())
    values = columns.heights
    if np.isnan(values).all():
        return ""
    png = io.BytesIO()
    if "colour" in map.layers:
        imsave(png, columns.image(columns.layer("colour")), origin="lower", format="png")
        return _image_html(png)
    # Unknown columns are white: on a dark page, a transparent background would hide the shape of the map. They are masked,
    # because some versions of matplotlib take the range of colors from NaN.
    colors = _color_map("voxtile").with_extremes(bad="white")
    imsave(png, np.ma.masked_invalid(values), origin="lower", format="png", cmap=colors)
    return _image_html(png)


def _image_html(png: io.BytesIO) -> str:
    return f'<img alt="from above" src="data:image/png;base64,{base64.b64encode(png.getvalue()).decode()}">'


def view(path: str | os.PathLike[str], snapshot: str | None = None) -> subprocess.Popen[bytes]:
    """Opens the viewer on a map or a snapshot in a browser. ``terminate`` ends the returned process."""
    shown = os.path.abspath(path) if snapshot is None else f"{os.path.abspath(path)}@{snapshot}"
    return subprocess.Popen([sys.executable, "-m", "voxtile", "view", shown])
