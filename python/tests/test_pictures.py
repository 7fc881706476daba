"""What notebooks show of a map, and arrays for other libraries."""

from __future__ import annotations

import base64
import pickle
import re
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import voxtile
from numpy.typing import NDArray
from voxtile import _voxtile


@pytest.fixture
def room(tmp_path: Path) -> Path:
    """Two walls, which leave most columns unknown."""
    along = np.arange(-3.0, 3.0, 0.1)
    walls = [np.stack([along, np.full(60, at), np.full(60, 0.3)], 1) for at in (-2.0, 2.0)]
    with voxtile.Map.create(tmp_path / "room", 0.25) as made:
        made.insert(np.concatenate(walls), origin=[0.0, 0.0, 0.3])
    return tmp_path / "room"


def pixels_of(png: bytes) -> NDArray[np.uint8]:
    """Decodes a PNG of eight bits per channel without the library that wrote it."""
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    at, data = 8, b""
    width = height = channels = 0
    while at < len(png):
        length, kind = struct.unpack(">I4s", png[at : at + 8])
        body = png[at + 8 : at + 8 + length]
        if kind == b"IHDR":
            width, height, depth, color, _, _, interlaced = struct.unpack(">IIBBBBB", body)
            assert (depth, interlaced) == (8, 0)
            channels = {2: 3, 6: 4}[color]
        elif kind == b"IDAT":
            data += body
        at += length + 12
    lines = np.frombuffer(zlib.decompress(data), np.uint8).reshape(height, 1 + width * channels)
    pixels = np.zeros((height + 1, width + 1, channels), np.int64)
    for row in range(height):
        method, line = lines[row, 0], lines[row, 1:].reshape(width, channels).astype(np.int64)
        for column in range(width):
            left, above, corner = pixels[row + 1, column], pixels[row, column + 1], pixels[row, column]
            guess = left + above - corner
            nearness = np.abs([guess - left, guess - above, guess - corner])
            paeth = np.choose(nearness.argmin(0), [left, above, corner])
            base = [0 * left, left, above, (left + above) // 2, paeth][method]
            pixels[row + 1, column + 1] = (line[column] + base) % 256
    return pixels[1:, 1:].astype(np.uint8)


def test_the_picture_of_a_summary_is_opaque(room: Path) -> None:
    pytest.importorskip("matplotlib")
    with voxtile.open(room) as found:
        text = found._repr_html_()
    encoded = re.search('src="data:image/png;base64,([^"]+)"', text)
    assert encoded is not None
    pixels = pixels_of(base64.b64decode(encoded[1]))
    assert pixels.shape[2] == 3 or (pixels[:, :, 3] == 255).all()
    colored = (pixels[:, :, :3] != 255).any(axis=2)
    # Two walls of 24 voxels; all other columns are unknown, hence white.
    assert colored.any(axis=1).sum() == 2 and 44 <= colored.sum() <= 52


@pytest.fixture
def painted(tmp_path: Path) -> Path:
    """A floor of 8 x 4 voxels, whose left half is brown ground and whose right half is a red building."""
    x, y = np.meshgrid(np.arange(8) + 0.5, np.arange(4) + 0.5)
    points = np.stack([x.ravel(), y.ravel(), np.full(32, 0.5)], 1)
    is_left = points[:, 0] < 4
    with voxtile.Map.create(tmp_path / "painted", 1.0, layers="colour,intensity,class") as made:
        made.insert(
            points,
            origin=[4.0, 2.0, 50.0],
            intensities=np.where(is_left, 10.0, 90.0),
            colours=np.where(is_left[:, None], [120, 80, 40], [250, 20, 10]),
            classes=np.where(is_left, 2, 6),
        )
    return tmp_path / "painted"


def test_the_picture_of_a_summary_has_the_colors_of_the_map(painted: Path) -> None:
    pytest.importorskip("matplotlib")
    with voxtile.open(painted) as found:
        text = found._repr_html_()
    encoded = re.search('src="data:image/png;base64,([^"]+)"', text)
    assert encoded is not None
    pixels = pixels_of(base64.b64decode(encoded[1]))[:, :, :3]
    counts = {tuple(color): count for color, count in zip(*np.unique(pixels.reshape(-1, 3), axis=0, return_counts=True))}
    assert counts.pop((120, 80, 40)) == 16 and counts.pop((250, 20, 10)) == 16
    assert set(counts) <= {(255, 255, 255)}


def test_a_plot_shows_a_layer(painted: Path, room: Path) -> None:
    pytest.importorskip("matplotlib")
    with voxtile.open(painted) as found:
        rgb, classes, intensities = (
            found.plot(color=color, region=[[0, 0, 0], [8, 4, 1]]) for color in ("rgb", "class", "intensity")
        )
        with pytest.raises(ValueError, match="height, rgb, intensity, class, age"):
            found.plot(color="heat")
    colors = rgb.axes[0].images[0].get_array()
    assert (colors[:, :4] == [120, 80, 40]).all() and (colors[:, 4:] == [250, 20, 10]).all()
    colors = classes.axes[0].images[0].get_array()
    assert (colors[:, :4] == [166, 124, 82]).all() and (colors[:, 4:] == [236, 126, 84]).all()
    assert [text.get_text() for text in classes.axes[0].get_legend().get_texts()] == ["2 ground", "6 building"]
    values = intensities.axes[0].images[0].get_array()
    assert np.allclose(values[:, :4], 10, atol=0.01) and np.allclose(values[:, 4:], 90, atol=0.01)
    with voxtile.open(room) as plain, pytest.raises(ValueError, match="layers='colour'"):
        plain.plot(color="rgb")


def test_a_plot_shows_times(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    scans = tmp_path / "scans"
    scans.mkdir()
    for number, stamp in enumerate(["1317042272.000000", "1317042284.500000"]):
        (scans / f"{stamp}.xyz").write_text(f"{5.5 + number} 0.5 0.5\n")
    (scans / "poses_tum.txt").write_text("1317042272 0 0 0 0 0 0 1\n1317042284.5 0 0 0 0 0 0 1\n")
    voxtile.build(scans, tmp_path / "map", resolution=1.0, layers="time")
    with voxtile.open(tmp_path / "map") as found:
        figure = found.plot(color="age")
    times = figure.axes[0].images[0].get_array()
    assert np.allclose(times[~np.isnan(times)], [0.0, 12.5])
    assert figure.axes[1].get_ylabel() == "last hit in s after 2011-09-26 13:04:32 UTC"


@pytest.mark.parametrize("mode", ["r", "r+"])
def test_a_plot_of_a_room_has_no_ceiling(tmp_path: Path, mode: Any) -> None:
    pytest.importorskip("matplotlib")
    x, y = (k.ravel() for k in np.meshgrid(np.arange(-3, 3, 0.1), np.arange(-2, 2, 0.1)))
    walls = [np.stack([x, np.full(x.size, at), np.abs(y) - 1.2], 1) for at in (-2.05, 2.05)]
    floor, ceiling = (np.stack([x, y, np.full(x.size, z)], 1) for z in (-1.25, 1.75))
    for name, points in (("room", [floor, ceiling, *walls]), ("open", [floor, *walls])):
        with voxtile.Map.create(tmp_path / name, 0.1) as made:
            made.insert(np.concatenate(points), origin=[0.05, 0.05, 0.05])
    with voxtile.Map.open(tmp_path / "room", mode) as found:
        cut, whole, low = (found.plot(max_height=height) for height in ("auto", None, -1.0))
        with pytest.raises(ValueError, match="max_height: 'high'"):
            found.plot(max_height="high")
    assert cut.axes[0].get_title() == "ceiling cut at 0.05 m, the height of the sensor"
    assert np.nanmax(cut.axes[0].images[0].get_array()) < 0.05
    assert whole.axes[0].get_title() == low.axes[0].get_title() == ""
    assert np.nanmax(whole.axes[0].images[0].get_array()) > 1.6
    assert np.nanmax(low.axes[0].images[0].get_array()) < -1.0
    with voxtile.Map.open(tmp_path / "open", mode) as found:
        assert found.plot().axes[0].get_title() == ""


def test_a_plot_has_the_colors_of_a_map_by_name(room: Path) -> None:
    pytest.importorskip("matplotlib")
    with voxtile.open(room) as found:
        for name, last in (("voxtile", None), ("gray", None), ("cividis", None), ("plasma", (240, 249, 33))):
            shown = found.plot(color_map=name).axes[0].images[0].get_cmap()
            wanted = np.divide(last or _voxtile.color_map(name)[-1], 255)
            assert np.allclose(shown(1.0)[:3], wanted, atol=0.005), name
        with pytest.raises(ValueError, match='"heat" is none of voxtile, viridis'):
            found.plot(color_map="heat")


def test_a_plot_is_a_picture_in_a_notebook(room: Path) -> None:
    pytest.importorskip("matplotlib")
    with voxtile.open(room) as found:
        figure = found.plot()
    png = figure._repr_png_()
    assert png.startswith(b"\x89PNG") and len(png) > 1000
    assert pickle.loads(pickle.dumps(figure))._repr_png_()[:4] == b"\x89PNG"
    formatters = pytest.importorskip("IPython.core.formatters")
    # As in a notebook that has not imported pyplot.
    assert formatters.PNGFormatter()(figure) == png


def test_dense_arrays_are_shared_with_other_libraries(room: Path) -> None:
    region = [[-3, -3, 0], [3, 3, 1]]
    with voxtile.open(room) as found:
        for values, of in (("occupancy", np.int8), ("probability", np.float64), ("log_odds", np.float64)):
            dense, _ = found.to_dense(region, values)
            assert dense.__dlpack_device__() == (1, 0)
            shared = np.from_dlpack(dense)
            assert shared.dtype == of and np.shares_memory(shared, dense)
            assert np.array_equal(shared, dense, equal_nan=True)
            assert dense.flags.writeable and dense.flags.c_contiguous
