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

from ._voxtile import Map

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST_PIXELS = 2048


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
    bounds = map.bounds if region is None else np.asarray(region, np.float64).reshape(2, 3)
    if bounds is None:
        return np.full((1, 1), np.nan), (0.0, 1.0, 0.0, 1.0)
    low, high = bounds
    edge = map.resolution * max(1, int(np.ceil((high - low)[:2].max() / map.resolution / max_pixels)))
    columns, rows = np.maximum(1, np.ceil((high - low)[:2] / edge - 1e-9)).astype(int)
    highest = np.full((rows, columns), -np.inf)
    for _, centers, _ in map.occupied_by_tile(min_probability):
        inside = centers[((low <= centers) & (centers < high)).all(axis=1)]
        at = np.floor((inside[:, :2] - low[:2]) / edge).astype(int)
        np.maximum.at(highest, (np.minimum(at[:, 1], rows - 1), np.minimum(at[:, 0], columns - 1)), inside[:, 2])
    highest[np.isinf(highest)] = np.nan
    extent = (float(low[0]), float(low[0] + columns * edge), float(low[1]), float(low[1] + rows * edge))
    return highest, extent


def plot(map: Map, *, region: Any = None, min_probability: float | None = None, ax: Axes | None = None) -> Figure:
    """Draws the map from above: the height of the highest occupied voxel of each column, in metres.

    ``region`` is a box, lower and upper corner; ``ax`` are axes to draw into. Needs matplotlib. Returns the figure. A
    notebook shows it as the result of a cell, or with ``display``; in a program, ``savefig`` writes it.
    """
    from matplotlib.figure import Figure as NewFigure

    values, extent = heights(map, region, min_probability)
    figure = NewFigure(figsize=(8, 6)) if ax is None else ax.figure
    axes = figure.add_subplot() if ax is None else ax
    image = axes.imshow(values, origin="lower", extent=extent, interpolation="nearest", cmap="viridis")
    axes.set_xlabel("x in m")
    axes.set_ylabel("y in m")
    axes.set_aspect("equal")
    figure.colorbar(image, ax=axes, label="height in m")
    whole: Figure = axes.get_figure(root=True)  # type: ignore[assignment]
    if ax is None:
        # Notebooks show figures by themselves only after pyplot was imported.
        setattr(whole, "_repr_png_", functools.partial(_png_of, whole))
    return whole


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


def _picture_html(map: Map) -> str:
    try:
        from matplotlib import colormaps
        from matplotlib.image import imsave
    except ImportError:
        return ""
    values, _ = heights(map, max_pixels=256)
    if np.isnan(values).all():
        return ""
    png = io.BytesIO()
    # Unknown columns are white: on a dark page, a transparent background would hide the shape of the map. They are masked,
    # because some versions of matplotlib take the range of colors from NaN.
    colors = colormaps["viridis"].with_extremes(bad="white")
    imsave(png, np.ma.masked_invalid(values), origin="lower", format="png", cmap=colors)
    return f'<img alt="from above" src="data:image/png;base64,{base64.b64encode(png.getvalue()).decode()}">'


def view(path: str | os.PathLike[str], snapshot: str | None = None) -> subprocess.Popen[bytes]:
    """Opens the viewer on a map or a snapshot in a browser. ``terminate`` ends the returned process."""
    shown = os.path.abspath(path) if snapshot is None else f"{os.path.abspath(path)}@{snapshot}"
    return subprocess.Popen([sys.executable, "-m", "voxtile", "view", shown])
