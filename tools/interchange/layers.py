"""Compares the layers of an exported map, as third-party libraries read them, with sums over its points.

    layers.py VOXTILE FOLDER COLOR_OCTREE

Makes three scans in FOLDER, one of them without colours and classes, and a map of them. COLOR_OCTREE is the program of
color_octree.cpp. Exits with 1 if a comparison fails.
"""

import csv
import subprocess
import sys
from collections import Counter
from pathlib import Path

import laspy
import numpy as np
import pye57
import rasterio
import trimesh
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from plyfile import PlyData, PlyElement

try:
    import pyarrow.parquet
except ImportError:  # large, so not part of short runs
    pyarrow = None

# Offsets in a voxel are whole multiples of a 2048th, so that single precision stores every point exactly.
EDGE = 0.25
SCANS = [(1_700_000_000_000_000_000, True), (1_700_000_001_500_000_000, True), (1_700_000_003_000_000_000, False)]


class Voxel:
    """Sums over the points that hit a voxel."""

    def __init__(self):
        self.points, self.colours, self.intensities, self.classes, self.times = [], [], [], Counter(), []

    def colour(self):
        count = len(self.colours)
        return tuple((sum(c[k] for c in self.colours) + count // 2) // count for k in range(3)) if count else None

    def intensity(self):
        return sum(self.intensities) / len(self.intensities) / 257

    def top_class(self):
        return min(self.classes, key=lambda c: (-self.classes[c], c)) if self.classes else None

    def mean(self):
        return np.mean(self.points, axis=0)


def make_scans(folder):
    """Writes the scans. Returns the voxels that their points hit."""
    rng = np.random.default_rng(11)
    x, y = np.meshgrid(np.arange(-30, 30), np.arange(-24, 24))
    floor = np.stack([x.ravel(), y.ravel(), np.full(x.size, -6)], 1)
    y, z = np.meshgrid(np.arange(-24, 24), np.arange(-6, 12))
    wall = np.stack([np.full(y.size, 30), y.ravel(), z.ravel()], 1)
    wanted, voxels, poses = np.concatenate([floor, wall]), {}, []
    for number, (stamp_ns, has_colours) in enumerate(SCANS):
        # The last scan also hits voxels that no other one does.
        some = rng.choice(len(wanted), 2500) if has_colours else np.arange(0, len(wanted), 2)
        index = wanted[some]
        inside = 2 * rng.integers(0, 1024, index.shape) + 1
        position = np.array([0.5 * number, -0.25 * number, 0.0])
        points = (index + inside / 2048) * EDGE
        # Patches of one colour, so that nodes of equal colours and log-odds exist.
        colours = (index // 8 * 37 + rng.integers(0, 2, (len(index), 1)) * (index[:, :1] > 0)) % 256
        intensities = rng.integers(0, 256, len(index))
        classes = (index[:, 1] // 5 + rng.integers(0, 3, len(index))) % 7
        fields = [(k, "<f4") for k in "xyz"] + [("intensity", "<f4")]
        fields += [(k, "u1") for k in ("red", "green", "blue", "class")] if has_colours else []
        rows = np.zeros(len(index), fields)
        for k, name in enumerate("xyz"):
            rows[name] = points[:, k] - position[k]
        rows["intensity"] = intensities
        if has_colours:
            for k, name in enumerate(("red", "green", "blue")):
                rows[name] = colours[:, k]
            rows["class"] = classes
        name = f"{stamp_ns // 10**9}.{stamp_ns % 10**9:09}"
        PlyData([PlyElement.describe(rows, "vertex")]).write(folder / f"{name}.ply")
        poses.append(f"{name} {position[0]} {position[1]} {position[2]} 0 0 0 1\n")
        for k in range(len(index)):
            voxel = voxels.setdefault(tuple(index[k].tolist()), Voxel())
            voxel.points.append(points[k])
            voxel.intensities.append(int(intensities[k]) * 257)
            voxel.times.append(stamp_ns)
            if has_colours:
                voxel.colours.append(tuple(colours[k].tolist()))
                voxel.classes[int(classes[k])] += 1
    (folder / "poses_tum.txt").write_text("".join(poses))
    return voxels


class Map:
    def __init__(self, program, folder):
        self.program, self.folder = program, folder
        clouds = folder / "clouds"
        clouds.mkdir(parents=True)
        self.hit = make_scans(clouds)
        layers = "colour,intensity,class,time,shape"
        poses = clouds / "poses_tum.txt"
        self.run("build", clouds, "--poses", poses, "-o", folder / "map", "--resolution", EDGE, "--layers", layers)
        with open(self.export("all.csv", "--what", "all"), newline="") as rows:
            self.rows = {self.index(row): row for row in csv.DictReader(rows)}
        with open(self.export("occupied.csv"), newline="") as rows:
            self.occupied = {self.index(row) for row in csv.DictReader(rows)}
        assert len(self.occupied) > 2000 and len(self.rows) > 10_000

    def run(self, *words):
        done = subprocess.run([str(word) for word in (self.program, *words)], capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(done.stderr.strip())

    def export(self, file, *options):
        path = self.folder / file
        self.run("export", self.folder / "map", "-o", path, *options)
        return path

    @staticmethod
    def index(row):
        return tuple(int(np.floor(float(row[k]) / EDGE)) for k in "xyz")

    def same(self, points, colours, no_colour, intensities, classes=None, no_class=0, times=None, within=1e-4):
        """Checks that every occupied voxel is read back once, with its layers."""
        index = [tuple(row) for row in np.floor(np.asarray(points) / EDGE).astype(int).tolist()]
        assert len(index) == len(self.occupied) and set(index) == self.occupied, "voxels differ"
        for k, at in enumerate(index):
            voxel = self.hit[at]
            wanted = voxel.colour() or no_colour
            assert tuple(int(c) for c in colours[k]) == wanted, f"{at}: colour {colours[k]}, not {wanted}"
            off = abs(float(intensities[k]) - voxel.intensity())
            assert off <= within, f"{at}: intensity {intensities[k]}, not {voxel.intensity()}"
            if classes is not None:
                found, wanted = int(classes[k]), voxel.top_class()
                assert found == (no_class if wanted is None else wanted), f"{at}: class {found}, not {wanted}"
            if times is not None:
                wanted = (min(voxel.times), max(voxel.times))
                assert tuple(times[k]) == wanted, f"{at}: times {times[k]}, not {wanted}"
        return f"{len(index)} voxels"

    def same_means(self, file, points):
        """Checks that the points are the mean points of the occupied voxels. Returns the largest distance in metres."""
        points = np.asarray(points, np.float64)
        index = [tuple(row) for row in np.floor(points / EDGE).astype(int).tolist()]
        assert len(index) == len(self.occupied) and set(index) == self.occupied, f"{file}: voxels differ"
        off = max(np.abs(point - self.hit[at].mean()).max() for at, point in zip(index, points))
        assert off < EDGE / 10_000, f"{file}: a mean point is {off} m off"
        return off


def xyz_of(columns, names="xyz"):
    return np.stack([np.asarray(columns[name], np.float64) for name in names], 1)


def csv_table(map):
    rows = [map.rows[at] for at in map.occupied]
    for row in rows:
        row["colour"] = tuple(int(row[k]) for k in ("red", "green", "blue")) if row["red"] else (0, 0, 0)
    return map.same(
        [[float(row[k]) for k in "xyz"] for row in rows],
        [row["colour"] for row in rows],
        (0, 0, 0),
        [row["intensity"] for row in rows],
        [row["class"] or 255 for row in rows],
        255,
        [(int(row["first_time_ns"]), int(row["last_time_ns"])) for row in rows],
    )


def ply(map):
    rows = PlyData.read(map.export("a.ply"))["vertex"]
    colours = xyz_of(rows, ("red", "green", "blue"))
    return map.same(xyz_of(rows), colours, (0, 0, 0), rows["intensity"], rows["class"])


def npz(map):
    with np.load(map.export("a.npz")) as a:
        assert a["colour"].dtype == np.uint8 and a["time_ns"].dtype == "<i8"
        times = [tuple(row) for row in a["time_ns"].tolist()]
        return map.same(a["xyz"], a["colour"], (0, 0, 0), a["intensity"], a["class"], times=times)


def las(map, file="a.las"):
    cloud = laspy.read(map.export(file))
    colours = np.stack([cloud.red, cloud.green, cloud.blue], 1)
    assert (colours % 257 == 0).all()
    # 16 bits; a voxel without a class is "created, never classified".
    intensities = cloud.intensity / 257
    return map.same(cloud.xyz, colours // 257, (0, 0, 0), intensities, cloud.classification, 1, within=0.5001 / 257)


def e57(map):
    file = pye57.E57(str(map.export("a.e57")))
    data = file.read_scan_raw(0)
    colours = xyz_of(data, ("colorRed", "colorGreen", "colorBlue"))
    limits = file.get_header(0)["intensityLimits"]["intensityMaximum"].value()
    assert limits == 255, limits
    return map.same(cartesian(data), colours, (0, 0, 0), data["intensity"])


def cartesian(data):
    return xyz_of(data, ("cartesianX", "cartesianY", "cartesianZ"))


def parquet(map):
    table = pyarrow.parquet.read_table(map.export("a.parquet")).to_pydict()
    colours = [c if c[0] is not None else (-1,) * 3 for c in zip(table["red"], table["green"], table["blue"])]
    classes = [-1 if c is None else c for c in table["class"]]
    times = list(zip(table["first_time_ns"], table["last_time_ns"]))
    return map.same(xyz_of(table), colours, (-1, -1, -1), table["intensity"], classes, -1, times)


def mcap_rows(path):
    types, rows = {5: "<i4", 6: "<u4", 7: "<f4", 8: "<f8"}, []
    with open(path, "rb") as file:
        for *_, cloud in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
            names, formats, offsets = zip(*((f.name, types[f.datatype], f.offset) for f in cloud.fields))
            of = np.dtype(dict(names=names, formats=formats, offsets=offsets, itemsize=cloud.point_step))
            rows.append(np.frombuffer(bytes(cloud.data), of))
    return np.concatenate(rows)


def mcap(map):
    rows = mcap_rows(map.export("a.mcap"))
    packed = rows["rgb"].copy().view("<u4")
    colours = np.stack([packed >> 16 & 255, packed >> 8 & 255, packed & 255], 1)
    times = [tuple(round(t * 10) * 10**8 for t in pair) for pair in zip(rows["first_time"], rows["last_time"])]
    return map.same(xyz_of(rows), colours, (0, 0, 0), rows["intensity"], rows["label"], times=times)


def geotiff(map):
    columns = {}
    for x, y, z in map.occupied:
        columns[x, y] = max(columns.get((x, y), z), z)
    with rasterio.open(map.export("a.tif")) as raster:
        names = [text.split(" of ")[0] for text in raster.descriptions[3:]]
        assert names == ["red", "green", "blue", "intensity", "class"], raster.descriptions
        bands = raster.read()
        rows, at = np.nonzero(~np.isnan(bands[0]))
        places = np.stack(raster.xy(rows, at), 1)
    found = {tuple(np.floor(place / EDGE).astype(int).tolist()): k for k, place in enumerate(places)}
    assert found.keys() == columns.keys()
    for (x, y), z in columns.items():
        values, voxel = bands[:, rows[found[x, y]], at[found[x, y]]], map.hit[x, y, z]
        assert values[0] == (z + 1) * EDGE
        wanted = [*(voxel.colour() or [np.nan] * 3), voxel.intensity(), voxel.top_class()]
        wanted = np.array([np.nan if value is None else value for value in wanted])
        assert np.allclose(values[3:], wanted, rtol=0, atol=1e-4, equal_nan=True), f"{x} {y}: {values}, not {wanted}"
    return f"{len(columns)} columns"


def glb(map, *options):
    """Every face has the colour of its voxel, and every exposed face exists."""
    loaded = trimesh.load(map.export("a.glb", *options), force="scene", process=False)
    (node,) = loaded.graph.nodes_geometry
    matrix, geometry = loaded.graph[node]
    mesh = loaded.geometry[geometry]
    world = np.asarray(mesh.vertices, np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    corners = np.rint(np.stack([world[:, 0], -world[:, 2], world[:, 1]], 1) / EDGE).astype(int)
    faces = np.asarray(mesh.faces).reshape(-1, 6)
    count = 0
    # glTF has linear colours.
    linear = np.asarray(mesh.visual.vertex_attributes["color"])[:, :3] / 65535
    colours = np.rint(255 * np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055))
    for quad in faces:
        places = corners[quad]
        normal = np.sign(np.cross(places[1] - places[0], places[2] - places[0]))
        low, high = places.min(0), places.max(0)
        axis = int(np.abs(normal).argmax())
        spans = [range(a, max(b, a + 1)) for a, b in zip(low.tolist(), high.tolist())]
        for x in spans[0]:
            for y in spans[1]:
                for z in spans[2]:
                    at = [x, y, z]
                    at[axis] -= 1 if normal[axis] > 0 else 0
                    count += 1
                    wanted = map.hit[tuple(at)].colour() or (128,) * 3
                    assert (colours[quad] == wanted).all(), f"{at}: {colours[quad][0]}, not {wanted}"
    exposed = 0
    for at in map.occupied:
        for axis in range(3):
            for side in (-1, 1):
                exposed += tuple(at[k] + side * (k == axis) for k in range(3)) not in map.occupied
    assert count == exposed, f"{count} faces, not {exposed}"
    return f"{count} faces in {len(faces)} rectangles"


def ot(map, program):
    path, again, averaged = map.export("a.ot"), map.folder / "again.ot", map.folder / "averaged.ot"
    found = subprocess.run([program, path, again, averaged], check=True, capture_output=True, text=True)
    rows = np.array([line.split() for line in found.stdout.splitlines()], np.float64)
    assert len(rows) == len(map.rows)
    for row in rows:
        at = tuple(np.floor(row[:3] / EDGE).astype(int).tolist())
        wanted = map.rows[at]
        colour = tuple(int(wanted[k]) for k in ("red", "green", "blue")) if wanted["red"] else (255, 255, 255)
        assert np.float32(row[3]) == np.float32(wanted["log_odds"]), f"{at}: log-odds {row[3]}"
        assert tuple(row[4:].astype(int).tolist()) == colour, f"{at}: {row[4:]}, not {colour}"
    assert again.read_bytes() == path.read_bytes(), "OctoMap writes other bytes"
    assert averaged.read_bytes() == path.read_bytes(), "OctoMap computes other inner nodes"
    nodes = int(path.read_bytes().split(b"size ")[1].split()[0])
    plain = map.export("plain.ot", "--no-layers")
    assert b"id OcTree\n" in plain.read_bytes()[:200] and plain.stat().st_size < path.stat().st_size
    return f"{len(rows)} voxels in {nodes} nodes, equal bytes"


def mean_points(map):
    """The mean points of all formats of points."""
    read = {
        "m.csv": lambda path: np.loadtxt(path, delimiter=",", skiprows=1, usecols=(0, 1, 2)),
        "m.xyz": lambda path: np.loadtxt(path)[:, :3],
        "m.ply": lambda path: xyz_of(PlyData.read(path)["vertex"]),
        "m.npz": lambda path: np.load(path)["xyz"],
        "m.las": lambda path: laspy.read(path).xyz,
        "m.copc.laz": lambda path: laspy.read(path).xyz,
        "m.e57": lambda path: cartesian(pye57.E57(str(path)).read_scan_raw(0)),
        "m.mcap": lambda path: xyz_of(mcap_rows(path)),
    }
    found = {file: map.same_means(file, of(map.export(file, "--mean-points"))) for file, of in read.items()}
    return f"{len(map.occupied)}, at most off by {max(found.values()):.1e} m ({max(found, key=found.get)})"


def main():
    map, program = Map(sys.argv[1], Path(sys.argv[2])), sys.argv[3]
    checks = [csv_table, ply, npz, las, e57, mcap, geotiff, glb, mean_points] + ([parquet] if pyarrow else [])
    checks = [(check.__name__, check) for check in checks]
    checks += [("copc", lambda map: las(map, "a.copc.laz")), ("glb quantized", lambda map: glb(map, "--quantize"))]
    checks += [("ot", lambda map: ot(map, program))]
    failed = False
    for label, check in checks:
        try:
            print(f"ok      layers, {label}: {check(map)}", flush=True)
        except Exception as error:  # continue with the other formats
            if "this build does not support it" in str(error):
                print(f"skipped layers, {label}: {error}", flush=True)
                continue
            failed = True
            print(f"FAILED  layers, {label}: {type(error).__name__}: {error}", flush=True)
    sys.exit(failed)


if __name__ == "__main__":
    main()
