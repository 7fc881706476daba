"""Folders for the shards of a map: which are accepted, and what is removed."""

from __future__ import annotations

import errno
import os
import re
import shutil
from pathlib import Path

import pytest
import voxtile
from conftest import matrix_of, scans_of
from voxtile import _voxtile, errors

pytest.importorskip("distributed")
shards = pytest.importorskip("voxtile.dask.shards")

OWN = re.compile("piece-[0-9]")


def test_a_folder_with_foreign_files_is_an_error_and_unchanged(tmp_path: Path) -> None:
    parts, other = tmp_path / "map.parts", tmp_path / "other"
    other.mkdir()
    (other / "piece-1").write_text("mine")

    def is_refused(message: str) -> None:
        with pytest.raises(errors.ArgumentError, match=f"{parts}: {message}"), shards.locked(parts, OWN):
            pytest.fail("the folder was locked")

    parts.symlink_to(other)
    is_refused("is a link or a file")
    parts.unlink()
    parts.write_text("mine")
    is_refused("is a link or a file")
    parts.unlink()
    parts.mkdir()
    (parts / "lock").symlink_to(other / "piece-1")
    is_refused("contains lock,")
    (parts / "lock").unlink()
    (parts / "piece-10").write_text("mine")
    is_refused("contains piece-10,")
    assert [path.name for path in parts.iterdir()] == ["piece-10"]
    assert (other / "piece-1").read_text() == "mine"


def test_the_folder_is_locked_and_results_are_kept(tmp_path: Path) -> None:
    parts = tmp_path / "map.parts"
    with shards.locked(parts, OWN):
        with pytest.raises(errors.ArgumentError, match="another process"), shards.locked(parts, OWN):
            pytest.fail("the folder was locked twice")
        (parts / "piece-1").mkdir()
    with shards.locked(parts, OWN):
        (parts / "piece-1").rmdir()
    assert list(tmp_path.iterdir()) == []


def test_a_file_system_that_renames_deleted_open_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    remove = shutil.rmtree

    # As on NFS: deleting an open file renames it within its folder.
    def rmtree(folder: str | Path, ignore_errors: bool = False) -> None:
        opened = [os.readlink(f"/proc/self/fd/{number}") for number in os.listdir("/proc/self/fd") if _is_open(number)]
        if not any(path.startswith(f"{folder}/") for path in opened):
            remove(folder, ignore_errors=ignore_errors)
        elif not ignore_errors:
            raise OSError(errno.ENOTEMPTY, os.strerror(errno.ENOTEMPTY), str(folder))

    if not os.path.isdir("/proc/self/fd"):
        pytest.skip("open files cannot be listed")
    monkeypatch.setattr(shutil, "rmtree", rmtree)
    parts = tmp_path / "map.parts"
    with pytest.raises(errors.ArgumentError, match="take another"), shards.locked(parts, OWN):
        raise errors.ArgumentError("take another")
    assert list(tmp_path.iterdir()) == []
    with shards.locked(parts, OWN):
        (parts / "piece-1").mkdir()
        shards.remove(parts)
    assert list(tmp_path.iterdir()) == []


def _is_open(number: str) -> bool:
    return os.path.islink(f"/proc/self/fd/{number}")


@pytest.mark.parametrize("inner", ["", "0" * 32])
def test_a_late_shard_does_not_recreate_a_removed_folder(
    inner: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    points, pose = scans_of(3, count=1)[0]
    with voxtile.Map.create(tmp_path / "map", resolution=0.5, tile_size=4.0) as made:
        made.insert(points, matrix_of(pose))
    _voxtile.crop(tmp_path / "map", tmp_path / "made", [-99, -99, -99, 99, 99, 99], shard_of="1" * 32)
    parts = tmp_path / "out" / "map.parts"
    (parts / inner).mkdir(parents=True)
    move = shards.move_shard

    def move_late(*given: str) -> None:
        shards.remove(parts)
        move(*given)

    monkeypatch.setattr(shards, "move_shard", move_late)
    with pytest.raises(FileNotFoundError, match="no longer needed"):
        shards.move_to_place(str(tmp_path / "made"), str(parts / inner / "piece"), "1" * 32)
    assert len(list((tmp_path / "out").iterdir())) == len(list((tmp_path / "out").glob("map.parts.gone-*"))) == 1


def test_an_attempt_removes_its_folder_and_earlier_ones(tmp_path: Path) -> None:
    beside, before = tmp_path / "files.unfinished", "0" * 32
    (beside / before).mkdir(parents=True)
    with pytest.raises(KeyboardInterrupt), shards.attempt_in(beside) as attempt:
        assert attempt.parent == beside and list(attempt.iterdir()) == []
        (attempt / "made").touch()
        raise KeyboardInterrupt
    assert list(tmp_path.iterdir()) == []
    with shards.attempt_in(beside) as attempt:
        os.rename(attempt, tmp_path / "files")
    assert [path.name for path in tmp_path.iterdir()] == ["files"]
