"""Operations on whole maps, files of scans, and the command."""

import json
import operator
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import voxtile
from conftest import Scan, matrix_of
from voxtile import errors


@pytest.fixture
def city(tmp_path: Path, room: list[Scan]) -> Path:
    with voxtile.Map.create(tmp_path / "city", 0.25, tile_size=4.0) as found:
        found.insert_many(room[:2])
        found.snapshot("early")
        found.insert_many(room[2:])
    return tmp_path / "city"


@pytest.fixture
def scans(tmp_path: Path, room: list[Scan]) -> Path:
    folder = tmp_path / "scans"
    folder.mkdir()
    header = "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
    for number, (points, _) in enumerate(room):
        sizes = f"WIDTH {len(points)}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(points)}\nDATA binary\n"
        (folder / f"{number}.pcd").write_bytes((header + sizes).encode() + points.tobytes())
    np.savetxt(folder / "poses_kitti.txt", [matrix_of(pose)[:3].reshape(-1) for _, pose in room], fmt="%.17g")
    return folder


def voxtile_command(*arguments: object) -> str:
    command = [sys.executable, "-m", "voxtile", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def test_build_makes_the_map_of_the_command(tmp_path: Path, scans: Path, room: list[Scan]) -> None:
    calls: list[tuple[int, int]] = []
    report = voxtile.build(
        scans, tmp_path / "built", resolution=0.25, max_range=4.0, progress=lambda *done: calls.append(done)
    )
    assert report["points"] == sum(len(points) for points, _ in room) and calls[-1] == (len(room), len(room))
    voxtile_command("build", scans, "-o", tmp_path / "commanded", "--resolution", 0.25, "--max-range", 4.0)
    with voxtile.Map.create(tmp_path / "inserted", 0.25, max_range=4.0) as inserted:
        inserted.insert_many(voxtile.scans(scans))
        digest = inserted.digest()
    assert voxtile.digest(tmp_path / "built") == voxtile.digest(tmp_path / "commanded") == digest
    assert voxtile_command("digest", tmp_path / "built").split()[0] == digest


def test_scans_are_those_of_the_files(scans: Path, room: list[Scan]) -> None:
    for (points, pose, intensities), (expected, expected_pose) in zip(voxtile.scans(scans), room, strict=True):
        assert intensities is None and np.array_equal(points, expected)
        np.testing.assert_allclose(pose, matrix_of(expected_pose), atol=1e-12)
    assert len(list(voxtile.scans(scans, first=1, every=2))) == 2
    found = iter(voxtile.scans(scans))
    assert operator.length_hint(found) == len(room)
    next(found)
    assert operator.length_hint(found) == len(room) - 1
    turned = np.array([[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1.0]])
    (_, pose, _), *_ = voxtile.scans(scans, count=1, extrinsic=turned)
    np.testing.assert_allclose(pose, matrix_of(room[0][1]) @ turned, atol=1e-12)
    with pytest.raises(errors.ArgumentError, match="nothing: there is no such file"):
        voxtile.scans(scans / "nothing")
    with pytest.raises(errors.ArgumentError, match="^pose_tolerance: "):
        voxtile.scans(scans, pose_tolerance=-1.0)


def test_options_as_text_and_as_numpy_scalars(tmp_path: Path, scans: Path, room: list[Scan]) -> None:
    rows = np.arange(15, dtype="<f4").reshape(3, 5)
    rows.tofile(tmp_path / "five.bin")
    for fields in ("x,y,z,intensity,ring", ["x", "y", "z", "intensity", "ring"]):
        ((points, _, intensities),) = voxtile.scans(tmp_path / "five.bin", fields=fields)
        assert np.array_equal(points, rows[:, :3]) and np.array_equal(intensities, rows[:, 3])
    report = voxtile.build(
        scans,
        tmp_path / "map",
        resolution=np.float32(0.25),
        count=np.int64(2),
        no_rays=np.bool_(True),
        keep_scans=np.bool_(False),
        max_range=np.array(4.0),
    )
    assert (report["scans"], report["points"]) == (2, sum(len(points) for points, _ in room[:2]))


def test_build_and_command_resume_each_other(tmp_path: Path, scans: Path, room: list[Scan]) -> None:
    """Build and command resume each other's maps and inputs."""
    whole, ours, theirs = tmp_path / "whole", tmp_path / "ours", tmp_path / "theirs"
    options = {"resolution": 0.25, "max_range": 4.0}
    voxtile.build(scans, whole, resolution=0.25, max_range=4.0)
    voxtile.build(scans, ours, count=2, resolution=0.25, max_range=4.0)
    with pytest.raises(errors.ExistsError, match="use .resume. to continue"):
        voxtile.build(scans, ours)
    with pytest.raises(errors.ArgumentError, match=".append. .again."):
        voxtile.build(scans, ours, append=True)
    answer = voxtile.build(scans, ours, resume=True)
    assert (answer["resumed_after"], answer["scans"], answer["interrupted"]) == (2, len(room) - 2, False)
    typed = [f"--{name.replace('_', '-')}={value}" for name, value in options.items()]
    voxtile_command("build", scans, "-o", theirs, "--count", 3, *typed)
    assert voxtile.build(scans, theirs, resume=True)["resumed_after"] == 3
    assert voxtile.digest(whole) == voxtile.digest(ours) == voxtile.digest(theirs)
    voxtile.build(scans, ours, append=True, again=True, max_range=4.0)
    voxtile_command("build", scans, "-o", theirs, "--append", "--again", *typed)
    assert voxtile.digest(ours) == voxtile.digest(theirs) != voxtile.digest(whole)


def test_a_build_reads_inputs_as_the_command_does(tmp_path: Path, scans: Path) -> None:
    """Lists, names with dashes, NumPy scalars, remarks as warnings."""
    ours, theirs = tmp_path / "ours", tmp_path / "theirs"
    box = np.array([[-1, -1, -1], [0.5, 1, 1]])
    with pytest.warns(UserWarning, match="all 1200 rays were cut at 1.5 m.*raise .max_range."):
        answer = voxtile.build(
            scans,
            ours,
            resolution=np.float64(0.25),
            max_range=1.5,
            ignore_box=box,
            round_points=0.002,
            insert_mode="per-ray",
            flush_every=2,
        )
    assert len(answer["remarks"]) == 2
    corners = [str(number) for number in box.reshape(-1)]
    how = ["--resolution=0.25", "--max-range=1.5", "--insert=per-ray", "--round-points=0.002", "--ignore-box", *corners]
    voxtile_command("build", scans, "-o", theirs, *how)
    assert voxtile.digest(ours) == voxtile.digest(theirs)
    with pytest.raises(errors.ArgumentError, match="unexpected argument 'resolutoin'"):
        voxtile.build(scans, tmp_path / "none", resolutoin=0.1)  # type: ignore[call-arg]
    assert not (tmp_path / "none").exists()


def test_names_that_look_like_options(tmp_path: Path, scans: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    scans.rename(tmp_path / "--json")
    voxtile.build("--json", "-o", resolution=0.25, tile_size=4)
    voxtile.export("-o", "--help.ply", region=[[-9, -9, -9], [9, 9, 9]])
    assert (tmp_path / "--help.ply").read_bytes().startswith(b"ply") and len(list(voxtile.scans("--json"))) == 4
    with pytest.raises(errors.MalformedError) as malformed:
        Path("a --b--.pcd").write_bytes(b"nothing")
        voxtile.build("a --b--.pcd", "c")
    assert malformed.value.path == Path("a --b--.pcd")


def test_snapshots(city: Path, tmp_path: Path) -> None:
    assert [snapshot["name"] for snapshot in voxtile.snapshots(city)] == ["early"]
    now, early = voxtile.digest(city), voxtile.digest(city, snapshot="early")
    sums = voxtile.diff((city, "early"), city)
    assert sums["appeared"] > 0 and sums["differing"]
    assert voxtile.diff(city, city)["differing"] == []
    voxtile.revert(city, "early", keep_as="late")
    assert voxtile.digest(city) == early and voxtile.digest(city, snapshot="late") == now
    voxtile.delete_snapshot(city, "early")
    assert [snapshot["name"] for snapshot in voxtile.snapshots(city)] == ["late"]
    voxtile.snapshot(city, "again")
    assert len(voxtile.snapshots(city)) == 2


def test_crop_clear_merge(city: Path, tmp_path: Path) -> None:
    digest, region = voxtile.digest(city), [[-2, -2, -9], [2, 2, 9]]
    voxtile.crop(city, tmp_path / "inside", region)
    voxtile.crop(city, tmp_path / "outside", region, outside=True)
    voxtile.merge([tmp_path / "inside", tmp_path / "outside"], tmp_path / "merged")
    assert voxtile.digest(tmp_path / "merged") == digest
    voxtile.clear(city, region)
    assert voxtile.digest(city) == voxtile.digest(tmp_path / "outside")
    with pytest.raises(errors.ArgumentError, match="prefer"):
        voxtile.merge([tmp_path / "inside", tmp_path / "outside"], tmp_path / "no", prefer="none")


def test_crop_by_a_polygon(city: Path, tmp_path: Path) -> None:
    square = [[-2, -2], [2, -2], [2, 2], [-2, 2], [-2, -2]]
    polygon = tmp_path / "square.geojson"
    polygon.write_text(json.dumps({"type": "Polygon", "coordinates": [square]}))
    voxtile.crop(city, tmp_path / "inside", [[-2, -2, -0.5], [2, 2, 0.5]])
    voxtile.crop(city, tmp_path / "cut", polygon=polygon, z=(-0.5, 0.5))
    assert voxtile.digest(tmp_path / "cut") == voxtile.digest(tmp_path / "inside")
    voxtile.crop(city, tmp_path / "rest", polygon=polygon, outside=True)
    with voxtile.open(tmp_path / "rest") as rest:
        centers, _ = rest.occupied()
        assert len(centers) and (np.abs(centers[:, :2]).max(axis=1) > 2).all()
    for wrong in ({}, {"region": [[0, 0, 0], [1, 1, 1]], "polygon": polygon}, {"polygon": polygon, "shard_of": "1" * 32}):
        with pytest.raises(errors.ArgumentError, match="^(region|shard_of): "):
            voxtile.crop(city, tmp_path / "no", **wrong)  # type: ignore[arg-type]
    with pytest.raises(errors.ArgumentError, match="^z: "):
        voxtile.crop(city, tmp_path / "no", [[0, 0, 0], [1, 1, 1]], z=(0, 1))


def test_builds_take_several_paths_and_any_resolution(scans: Path, room: list[Scan], tmp_path: Path) -> None:
    files = sorted(scans.glob("*.pcd"), key=lambda path: int(path.stem))
    done: list[tuple[int, int]] = []
    report = voxtile.build(files, tmp_path / "files", resolution=0.15, progress=lambda *now: done.append(now))
    assert report["scans"] == len(files) == done[-1][0] and report["tile_size_m"] == 10.05
    voxtile.build(scans, tmp_path / "folder", resolution=0.15)
    assert voxtile.digest(tmp_path / "files") == voxtile.digest(tmp_path / "folder")
    with voxtile.Map.create(tmp_path / "made", 0.15, max_range=100.0) as made:
        assert made.tile_size == 10.05
        made.insert_many(voxtile.scans(files))
        assert made.digest() == voxtile.digest(tmp_path / "files")
    with pytest.raises(errors.ArgumentError, match="given twice"):
        voxtile.build([files[0], files[0]], tmp_path / "twice")
    with pytest.raises(errors.ArgumentError, match="none"):
        voxtile.build([], tmp_path / "nothing")
    with pytest.raises(errors.VoxtileError, match="10.05"):
        voxtile.Map.create(tmp_path / "odd", 0.15, tile_size=10.0)


def test_decay_verify_repair(city: Path) -> None:
    sums = voxtile.decay(city, 2.0, scans=2)
    assert sums["factor"] == 0.5 and sums["voxels"] > 0
    assert voxtile.verify(city)["damage"] == 0
    damaged = next(city.glob("tile_*/iwlo_meta.bin"))
    damaged.write_bytes(damaged.read_bytes()[:-1] + b"\xff")
    findings = voxtile.verify(city)["findings"]
    assert any(Path(finding["path"]).parent == damaged.parent for finding in findings)
    with voxtile.open(city) as found, pytest.raises(errors.DamagedError) as error:
        found.occupied()
    assert error.value.path == damaged and error.value.tile is not None
    assert voxtile.repair(city)["tiles_lost"] == 1
    assert voxtile.verify(city)["damage"] == 0


def test_voxels_without_recent_hits_are_forgotten(tmp_path: Path) -> None:
    day_ns, first = 86_400 * 10**9, 15_000
    scans = tmp_path / "scans"
    scans.mkdir()
    seconds = [(first + day) * 86_400 for day in range(3)]
    for day, stamp in enumerate(seconds):
        (scans / f"{stamp}.000000.xyz").write_text(f"{2.1 + day} {day + 1.1} 0.1\n")
    (scans / "poses_tum.txt").write_text("".join(f"{stamp} 0.1 0.1 0.1 0 0 0 1\n" for stamp in seconds))
    voxtile.build(scans, tmp_path / "map", resolution=0.25, layers="time")
    with pytest.raises(errors.ArgumentError, match="seconds: must be at least 0"):
        voxtile.forget_old(tmp_path / "map", -1.0)
    report = voxtile.forget_old(tmp_path / "map", 1.5 * 86_400)
    assert report["voxels_forgotten"] == 1 and report["oldest_ns"] == (2 * first + 1) * day_ns // 2
    assert voxtile.forget_old(tmp_path / "map", 86_400, now_ns=(first + 4) * day_ns)["voxels_forgotten"] == 2
    with voxtile.Map.create(tmp_path / "plain", 0.25), pytest.raises(errors.VoxtileError):
        voxtile.forget_old(tmp_path / "plain", 1.0)


def test_export_and_files_of_octomap(city: Path, tmp_path: Path) -> None:
    voxtile.export(city, tmp_path / "city.ot")
    calls: list[tuple[int, int]] = []
    answer = voxtile.export(city, tmp_path / "city.ply", what="all", progress=lambda *done: calls.append(done))
    with voxtile.open(city) as ours:
        assert answer["voxels"] == len(ours.occupied(min_probability=0.0)[0]) and calls
    assert (tmp_path / "city.ply").read_bytes().startswith(b"ply\n")
    with voxtile.open(city) as ours, voxtile.open(tmp_path / "city.ot") as theirs:
        at = np.random.default_rng(5).uniform(-6, 6, (4000, 3))
        assert np.array_equal(ours.occupancy(at), theirs.occupancy(at))
        assert not theirs.writable
    for needs_a_folder in (voxtile.verify, voxtile.repair, voxtile.snapshots):
        with pytest.raises(errors.ArgumentError, match="city.ot: is an OctoMap file"):
            needs_a_folder(tmp_path / "city.ot")
    meshes = [tmp_path / "plain.glb", tmp_path / "quantized.glb"]
    for mesh, quantize in zip(meshes, [False, True], strict=True):
        voxtile.export(city, mesh, quantize=quantize)
        assert (b"KHR_mesh_quantization" in mesh.read_bytes()) is quantize
    assert meshes[0].stat().st_size > meshes[1].stat().st_size
    voxtile.import_octree(tmp_path / "city.ot", tmp_path / "imported", storage="compact")
    with voxtile.open(tmp_path / "imported") as imported, voxtile.open(city) as ours:
        assert len(imported.occupied()[0]) == len(ours.occupied()[0])
    voxtile.export(city, tmp_path / "metres.xyz")
    voxtile.export(city, tmp_path / "feet.xyz", unit="ft")
    metres, feet = (np.loadtxt(tmp_path / name)[:, :3] for name in ("metres.xyz", "feet.xyz"))
    assert np.allclose(metres, feet * 0.3048, atol=1e-3)
    with pytest.raises(errors.ArgumentError, match="^unit: m, but the unit of EPSG:2230 is us-ft"):
        voxtile.export(city, tmp_path / "city.laz", crs="EPSG:2230", unit="m")
    with pytest.raises(errors.ArgumentError, match="^output: .*its extension is unknown"):
        voxtile.export(city, tmp_path / "city.what")

    def raising(done: int, all: int) -> None:
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="^enough$"):
        voxtile.export(city, tmp_path / "given_up.csv", progress=raising)
    assert not (tmp_path / "given_up.csv").exists()
    with pytest.raises(errors.NoMapError) as missing:
        voxtile.export(tmp_path / "none", tmp_path / "none.ply")
    assert missing.value.path == tmp_path / "none"


def test_the_command(city: Path) -> None:
    info = json.loads(voxtile_command("info", city, "--json"))
    assert info["version"] == 1
    script = Path(sys.executable).parent / "voxtile"
    assert script.exists() and os.access(script, os.X_OK)
    done = subprocess.run([script, "info", city / "nothing"], capture_output=True, text=True, check=False)
    assert done.returncode == 1 and "no map here" in done.stderr
    done = subprocess.run([script, "no-such-command"], capture_output=True, text=True, check=False)
    assert done.returncode == 2


def test_pictures(city: Path) -> None:
    from voxtile.pictures import heights

    with voxtile.open(city) as found:
        values, extent = heights(found)
        centers, _ = found.occupied()
        assert np.nanmax(values) == centers[:, 2].max() and extent[0] <= centers[:, 0].min()
        columns = {tuple(at) for at in np.floor(centers[:, :2] / 0.25).astype(int).tolist()}
        assert np.count_nonzero(~np.isnan(values)) == len(columns)
        assert "0.25 m" in found._repr_html_()
        pytest.importorskip("matplotlib")
        assert found.plot().axes[0].get_xlabel() == "x in m"
        assert "data:image/png" in found._repr_html_()
