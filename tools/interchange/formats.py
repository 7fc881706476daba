"""Reads voxels back from every format that voxtile-formats writes, with third-party libraries; see formats.sh."""

import json
import math
import subprocess
import sys
from pathlib import Path

import laspy
import numpy as np
import pyarrow.parquet
import pye57
import rasterio
import trimesh
import yaml
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from PIL import Image

try:
    import open3d
except ImportError:  # optional: it takes half a gigabyte
    open3d = None

RESOLUTION = 0.1
UTM = (500123.4, 4182321.7, 57.3)
SCENES = {
    # Name: coordinates of index 0, offset of the indices, offset subtracted for single precision.
    "near": ((0.0, 0.0, 0.0), (0, 0, 0), (0.0, 0.0, 0.0)),
    "utm": (UTM, (0, 0, 0), (500000.0, 4182000.0, 0.0)),
    "far indices": ((0.0, 0.0, 0.0), (5001234, 41823217, 573), (500000.0, 4182000.0, 0.0)),
}


def make_voxels():
    """A floor, a wall, a ball, noise, and free voxels between them, across the origin."""
    rng = np.random.default_rng(7)
    x, y = np.meshgrid(np.arange(-150, 150), np.arange(-120, 120))
    floor = np.stack([x.ravel(), y.ravel(), (x.ravel() + 400) // 60 - 8], 1)
    y, z = np.meshgrid(np.arange(-120, 120), np.arange(0, 40))
    wall = np.stack([np.full(y.size, 32), y.ravel(), z.ravel()], 1)
    ball = np.argwhere(np.linalg.norm(np.indices((30, 30, 30)) - 14.5, axis=0) < 14) + [-64, -64, 2]
    noise = rng.integers(-140, 140, (3000, 3))
    voxels = np.unique(np.concatenate([floor, wall, ball, noise]), axis=0)
    log_odds = rng.uniform(-2, 3.5, len(voxels))
    count = rng.integers(1, 1 << 20, len(voxels))
    return voxels, log_odds, count


class Scene:
    def __init__(self, name, program, work):
        self.origin, self.shift, self.subtract = SCENES[name]
        self.name, self.program, self.work = name, program, work
        self.voxels, self.log_odds, self.count = make_voxels()
        self.voxels = self.voxels + self.shift
        self.probability = 1 / (1 + np.exp(-self.log_odds))
        self.table = work / "voxels.csv"
        rows = zip(self.voxels.tolist(), self.log_odds.tolist(), self.count.tolist())
        self.table.write_text("".join(f"{x},{y},{z},{l!r},{c}\n" for (x, y, z), l, c in rows))

    def write(self, format, file, *options):
        path = self.work / self.name.replace(" ", "_") / file
        path.parent.mkdir(exist_ok=True)
        command = [self.program, format, self.table, path, "--resolution", RESOLUTION, "--origin", *self.origin]
        command += ["--subtract", *self.subtract, *options]
        subprocess.run([str(word) for word in command], check=True)
        return path

    def same(self, points, log_odds=None, count=None, probability=None, tolerance=1e-6):
        """Checks that every voxel is read back once, at its index, with its values."""
        points = np.asarray(points, dtype=np.float64)
        index = np.floor((points - self.origin) / RESOLUTION).astype(np.int64)
        away = np.abs((points - self.origin) / RESOLUTION - index - 0.5).max()
        order = np.lexsort(index.T[::-1])
        expected = np.lexsort(self.voxels.T[::-1])
        assert len(index) == len(self.voxels), f"{len(index)} voxels of {len(self.voxels)}"
        assert (index[order] == self.voxels[expected]).all(), "a voxel is read back at another index"
        for name, found, wanted, within in [
            ("log_odds", log_odds, self.log_odds, 0),
            ("count", count, self.count, 0),
            ("probability", probability, self.probability, tolerance),
        ]:
            if found is not None:
                off = np.abs(np.asarray(found, dtype=np.float64)[order] - wanted[expected]).max()
                assert off <= within, f"{name} is off by {off}"
        return f"{len(index)} voxels, centers {away:.1e} voxels off at most"


def xyz(scene):
    rows = np.loadtxt(scene.write("xyz", "a.xyz"))
    return scene.same(rows[:, :3], probability=rows[:, 3], tolerance=1e-15)


def npz(scene):
    arrays = np.load(scene.write("npz", "a.npz"))
    shapes = {name: (arrays[name].dtype.str, arrays[name].ndim) for name in arrays.files}
    assert shapes == {"xyz": ("<f8", 2), "log_odds": ("<f8", 1), "probability": ("<f4", 1), "count": ("<i4", 1)}, shapes
    return scene.same(arrays["xyz"], arrays["log_odds"], arrays["count"], arrays["probability"])


def nav2(scene):
    path = scene.write("nav2", "map.pgm")
    metadata = yaml.safe_load(path.with_suffix(".yaml").read_text())
    picture = np.asarray(Image.open(path.with_name(metadata["image"])))
    p = (255.0 - picture) / 255.0
    states = np.full(picture.shape, -1)
    states[p > metadata["occupied_thresh"]] = 100
    states[p < metadata["free_thresh"]] = 0
    expected = {}
    for (x, y, _), occupied in zip(scene.voxels.tolist(), scene.log_odds >= 0):
        expected[x, y] = max(expected.get((x, y), 0), 100 if occupied else 0)
    found = {}
    for row, column in np.argwhere(states >= 0):
        at = [(column + 0.5) * metadata["resolution"], (picture.shape[0] - row - 0.5) * metadata["resolution"]]
        index = [math.floor((at[k] + metadata["origin"][k] - scene.origin[k]) / RESOLUTION) for k in range(2)]
        found[tuple(index)] = states[row, column]
    assert found == expected, "columns differ"
    unknown = (states < 0).sum()
    assert unknown > 0 and 0 in found.values() and 100 in found.values()
    return f"{len(found)} columns, {unknown} unknown, by nav2's rule"


def heightmap(scene):
    path = scene.write("heightmap", "h.png")
    picture = Image.open(path)
    scale, offset = float(picture.text["scale_m"]), float(picture.text["offset_m"])
    assert json.loads(path.with_suffix(".json").read_text())["scale_m"] == scale
    a, d, b, e, c, f = map(float, path.with_suffix(".pgw").read_text().split())
    assert d == b == 0
    values = np.asarray(picture)
    rows, columns = np.nonzero(values)
    heights = offset + scale * values[rows, columns]
    points = np.stack([c + a * columns, f + e * rows, heights], 1)
    index = np.floor((points - scene.origin) / RESOLUTION).astype(np.int64)
    top = {}
    for x, y, z in scene.voxels[scene.log_odds >= 0].tolist():
        top[x, y] = max(top.get((x, y), z), z)
    assert {(x, y): z for x, y, z in index.tolist()} == top, "heights differ"
    return f"{len(top)} heights"


def geotiff(scene):
    columns = {}
    for x, y, z in scene.voxels[scene.log_odds >= 0].tolist():
        columns.setdefault((x, y), []).append(z)
    with rasterio.open(scene.write("geotiff", "dem.tif", "--crs", "EPSG:25832")) as raster:
        assert raster.crs.to_epsg() == 25832 and raster.dtypes == ("float32",) * 3 and np.isnan(raster.nodatavals).all()
        assert raster.profile["compress"] == "deflate" and raster.block_shapes == [(256, 256)] * 3
        assert raster.descriptions[0].startswith("top of the highest")
        low, high = scene.voxels.min(0)[:2], scene.voxels.max(0)[:2] + 1
        bounds = np.concatenate([low, high]) * RESOLUTION + [*scene.origin[:2]] * 2
        assert np.abs(np.array(raster.bounds) - bounds).max() < 1e-6, f"{raster.bounds}, not {bounds}"
        bands = raster.read()
        rows, at = np.nonzero(~np.isnan(bands[0]))
        places = np.stack(raster.xy(rows, at), 1)
    index = np.floor((places - scene.origin[:2]) / RESOLUTION).astype(np.int64)
    assert {tuple(column) for column in index.tolist()} == set(columns), "columns differ"
    found = bands[:, rows, at] - scene.origin[2]
    zs = [columns[x, y] for x, y in index.tolist()]
    wanted = [[max(z) + 1 for z in zs], [min(z) for z in zs], [sum(z) / len(z) + 0.5 for z in zs]]
    off = np.abs(found - np.array(wanted) * RESOLUTION).max()
    assert off < 1e-4, f"heights are {off} m off"
    with rasterio.open(scene.write("geotiff", "local.tif")) as raster:
        assert "voxels" in raster.crs.to_wkt(), raster.crs
    return f"{len(columns)} columns, heights {off:.1e} m off at most"


def las(scene, format="las", file="a.las"):
    cloud = laspy.read(scene.write(format, file))
    header = cloud.header
    assert str(header.version) == "1.4" and header.point_format.id == 6
    assert header.global_encoding.wkt and any(vlr.record_id == 2112 for vlr in header.vlrs)
    assert (cloud.return_number == 1).all() and (cloud.number_of_returns == 1).all()
    assert np.allclose([cloud.xyz.min(0), cloud.xyz.max(0)], [header.mins, header.maxs], rtol=0, atol=1e-9)
    return scene.same(cloud.xyz, cloud.log_odds, cloud["count"], cloud.intensity / 65535, tolerance=1e-5)


def laz(scene):
    return las(scene, "laz", "a.laz")


def copc(scene):
    path = scene.write("copc", "a.copc.laz")
    at = lambda points: np.stack([points.x, points.y, points.z], 1)
    with laspy.CopcReader.open(path) as reader:
        cloud = reader.query()
        xyz = at(cloud)
        metadata = scene.same(xyz, cloud.log_odds, cloud["count"], cloud.intensity / 65535, tolerance=1e-5)
        coarse = [len(reader.query(level=level)) for level in range(3)]
        # The coarsest level alone covers the whole map: it has exactly one point in each of its cells that contains
        # voxels.
        cell = reader.copc_info.spacing
        corner = np.array(reader.copc_info.center) - reader.copc_info.halfsize
        cells = np.unique(np.floor((xyz - corner) / cell).astype(int), axis=0)
        shown = np.unique(np.floor((at(reader.query(level=0)) - corner) / cell).astype(int), axis=0)
        assert len(cells) == len(shown) == coarse[0], "level 0 does not show every cell once"
        half = (xyz.min(0) + xyz.max(0)) / 2
        box = laspy.copc.Bounds(xyz.min(0), half)
        inside = (xyz <= half).all(1).sum()
        assert len(reader.query(bounds=box)) == inside, "a box gives other points"
    # The file is also readable as plain LAZ.
    scene.same(laspy.read(path).xyz)
    return f"{metadata}; levels {coarse}"


def copc_npm(scene, script):
    path = scene.write("copc", "b.copc.laz")
    found = json.loads(subprocess.run(["node", script, "copc", path], check=True, capture_output=True).stdout)
    assert found["outside"] == 0, f"{found['outside']} coordinates outside their node"
    assert found["header"] == len(scene.voxels) and found["wkt"], "header"
    points = np.array(found["points"])
    return f"{scene.same(points[:, :3], points[:, 3], points[:, 4])}; levels {list(found['levels'].values())}"


def exposed_faces(voxels):
    occupied = set(map(tuple, voxels.tolist()))
    faces = set()
    for x, y, z in occupied:
        for axis in range(3):
            for side in (-1, 1):
                neighbour = [x, y, z]
                neighbour[axis] += side
                if tuple(neighbour) not in occupied:
                    normal = tuple(side if k == axis else 0 for k in range(3))
                    faces.add(((x, y, z), normal))
    return faces


def glb(scene):
    return check_mesh(scene, scene.write("glb", "a.glb"))


def quantized_glb(scene):
    path = scene.write("glb", "q.glb", "--quantize")
    assert b"KHR_mesh_quantization" in path.read_bytes()
    return check_mesh(scene, path)


def open3d_glb(scene):
    """Open3D cannot read quantized vertices, and merges equal ones: compares the area."""
    mesh = open3d.io.read_triangle_mesh(str(scene.write("glb", "o.glb")))
    turned = np.asarray(mesh.vertices)[:, [0, 2, 1]] * [1, -1, 1]
    lattice = (turned - scene.origin) / RESOLUTION
    away = np.abs(lattice - np.rint(lattice)).max()
    assert away < 1e-3, away
    faces = len(exposed_faces(scene.voxels[scene.log_odds >= 0]))
    area = mesh.get_surface_area() / RESOLUTION**2
    assert abs(area - faces) < 1e-6 * faces, f"area {area}, not {faces}"
    return f"{len(mesh.triangles)} triangles, vertices {away:.1e} voxels off at most"


def check_mesh(scene, path):
    loaded = trimesh.load(path, force="scene", process=False)
    (node,) = loaded.graph.nodes_geometry
    matrix, geometry = loaded.graph[node]
    mesh = loaded.geometry[geometry]
    # Vertices are whole numbers of voxels, which the node's matrix scales to metres. In glTF, y is up.
    world = np.asarray(mesh.vertices, np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    turned = np.stack([world[:, 0], -world[:, 2], world[:, 1]], 1)
    lattice = (turned - scene.origin) / RESOLUTION
    corners = np.rint(lattice).astype(np.int64)
    assert np.abs(lattice - corners).max() < 1e-2, np.abs(lattice - corners).max()
    expected = exposed_faces(scene.voxels[scene.log_odds >= 0])
    assert abs(mesh.area - len(expected)) < 1e-6 * len(expected), f"area {mesh.area}, not {len(expected)}"
    quads = corners[np.asarray(mesh.faces)].reshape(-1, 6, 3)
    found = set()
    for quad in quads:
        normal = np.sign(np.cross(quad[1] - quad[0], quad[2] - quad[0]))
        low, high = quad.min(0), quad.max(0)
        axis = int(np.abs(normal).argmax())
        spans = [range(a, max(b, a + 1)) for a, b in zip(low.tolist(), high.tolist())]
        for x in spans[0]:
            for y in spans[1]:
                for z in spans[2]:
                    voxel = [x, y, z]
                    voxel[axis] -= 1 if normal[axis] > 0 else 0
                    face = (tuple(voxel), tuple(normal.tolist()))
                    assert face not in found, f"{face} twice"
                    found.add(face)
    assert found == expected, f"{len(found ^ expected)} faces differ"
    data = path.read_bytes()
    metadata = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    low = scene.voxels[scene.log_odds >= 0].min(0) * RESOLUTION + scene.origin
    assert np.allclose(metadata["nodes"][0]["extras"]["origin_m"], low, rtol=0, atol=1e-6)
    return f"{len(found)} faces in {len(quads)} rectangles"


def glb_npm(scene, script):
    for options in [[], ["--quantize"]]:
        path = scene.write("glb", "b.glb", *options)
        report = json.loads(subprocess.run(["node", script, "gltf", path], check=True, capture_output=True).stdout)
        assert report["errors"] == report["warnings"] == 0, report
    return "gltf-validator finds nothing"


def e57(scene):
    file = pye57.E57(str(scene.write("e57", "a.e57")))
    assert file.scan_count == 1
    data = file.read_scan(0, intensity=True, ignore_missing_fields=True)
    points = np.stack([data["cartesianX"], data["cartesianY"], data["cartesianZ"]], 1)
    return scene.same(points, probability=data["intensity"])


def parquet(scene):
    table = pyarrow.parquet.read_table(scene.write("parquet", "a.parquet"))
    columns = {name: table[name].to_numpy() for name in table.column_names}
    points = np.stack([columns[k] for k in "xyz"], 1)
    tiles = np.stack([columns[f"tile_{k}"] for k in "xyz"], 1)
    index = np.floor((points - scene.origin) / RESOLUTION).astype(np.int64)
    assert (tiles == index // 32).all() and tiles.dtype == np.int32, "tiles"
    return scene.same(points, columns["log_odds"], columns["count"], columns["probability"])


def read_pcd(path):
    data = path.read_bytes()
    head, body = data.split(b"DATA binary\n", 1)
    fields = dict(line.split(" ", 1) for line in head.decode().splitlines() if not line.startswith("#"))
    assert (fields["FIELDS"], fields["SIZE"], fields["TYPE"]) == ("x y z intensity", "4 4 4 4", "F F F F")
    rows = np.frombuffer(body, np.float32).reshape(-1, 4).astype(np.float64)
    assert len(rows) == int(fields["POINTS"])
    return rows


def autoware(scene):
    folder = scene.write("autoware", "pointcloud_map")
    metadata = yaml.safe_load((folder / "pointcloud_map_metadata.yaml").read_text())
    edges = np.array([metadata.pop("x_resolution"), metadata.pop("y_resolution")])
    assert set(metadata) == {path.name for path in folder.glob("*.pcd")} and len(metadata) > 3
    rows = []
    for name, corner in metadata.items():
        points = read_pcd(folder / name)
        assert (points[:, :2] >= corner).all() and (points[:, :2] < corner + edges).all(), f"{name}: outside"
        rows.append(points)
    rows = np.concatenate(rows)
    return f"{scene.same(rows[:, :3] + scene.subtract, probability=rows[:, 3])}; {len(metadata)} files"


def mcap(scene):
    rows, clouds = [], 0
    types = {5: "<i4", 7: "<f4", 8: "<f8"}
    with open(scene.write("mcap", "a.mcap"), "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2"
        for schema, channel, message, cloud in reader.iter_decoded_messages(topics=["/voxels"]):
            assert schema.name == "sensor_msgs/msg/PointCloud2" and channel.message_encoding == "cdr"
            assert (cloud.header.frame_id, cloud.header.stamp.sec) == ("map", 1_700_000_000)
            assert cloud.header.stamp.nanosec == 123_456_789 and not cloud.is_bigendian and cloud.is_dense
            assert cloud.row_step == len(cloud.data) == cloud.width * cloud.point_step and cloud.height == 1
            names, formats, offsets = zip(*((f.name, types[f.datatype], f.offset) for f in cloud.fields))
            of = np.dtype(dict(names=names, formats=formats, offsets=offsets, itemsize=cloud.point_step))
            rows.append(np.frombuffer(bytes(cloud.data), of))
            clouds += 1
    rows = np.concatenate(rows)
    points = np.stack([rows[k].astype(np.float64) for k in "xyz"], 1)
    metadata = scene.same(points, rows["log_odds"], rows["count"], rows["intensity"])
    return f"{metadata}; {clouds} clouds, {rows['x'].dtype}"


def main():
    program, work = sys.argv[1], Path(sys.argv[2])
    script = sys.argv[4] if sys.argv[3:4] == ["--npm"] else None
    failed = False
    formats = [xyz, npz, nav2, heightmap, geotiff, las, laz, glb, quantized_glb, e57, parquet, autoware, copc, mcap]
    for name in SCENES:
        scene = Scene(name, program, work)
        checks = [(check.__name__, check) for check in formats]
        if open3d:
            checks += [("glb (Open3D)", open3d_glb)]
        if script:
            checks += [("copc (npm)", lambda scene: copc_npm(scene, script))]
            checks += [("glb (npm)", lambda scene: glb_npm(scene, script))]
        for label, check in checks:
            try:
                print(f"ok      {name}, {label}: {check(scene)}", flush=True)
            except Exception as error:  # continue with the other formats
                failed = True
                print(f"FAILED  {name}, {label}: {type(error).__name__}: {error}", flush=True)
    sys.exit(failed)


if __name__ == "__main__":
    main()
