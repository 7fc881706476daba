"""Folders in which pieces of a map wait: whose they are, and what is removed."""

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
pieces = pytest.importorskip("voxtile.dask.pieces")

OWN = re.compile("piece-[0-9]")


def test_a_folder_of_somebody_is_left_as_it_is(tmp_path: Path) -> None:
    parts, other = tmp_path / "map.parts", tmp_path / "other"
    other.mkdir()
    (other / "piece-1").write_text("mine")

    def is_refused(told: str) -> None:
        with pytest.raises(errors.ArgumentError, match=f"{parts}: {told}"), pieces.locked(parts, OWN):
            pytest.fail("it was taken")

    parts.symlink_to(other)
    is_refused("pieces need a folder .* a link")
    parts.unlink()
    parts.write_text("mine")
    is_refused("pieces need a folder .* a file")
    parts.unlink()
    parts.mkdir()
    (parts / "lock").symlink_to(other / "piece-1")
    is_refused("lock in it")
    (parts / "lock").unlink()
    (parts / "piece-10").write_text("mine")
    is_refused("piece-10 in it")
    assert [path.name for path in parts.iterdir()] == ["piece-10"]
    assert (other / "piece-1").read_text() == "mine"


def test_one_at_a_time_has_the_folder_and_what_was_made_stays(tmp_path: Path) -> None:
    parts = tmp_path / "map.parts"
    with pieces.locked(parts, OWN):
        with pytest.raises(errors.ArgumentError, match="another process"), pieces.locked(parts, OWN):
            pytest.fail("it was taken twice")
        (parts / "piece-1").mkdir()
    with pieces.locked(parts, OWN):
        (parts / "piece-1").rmdir()
    assert list(tmp_path.iterdir()) == []


def test_a_file_system_that_keeps_open_files_hides_no_error_and_keeps_no_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    remove = shutil.rmtree

    # As NFS: a file that is open gets another name in its folder.
    def rmtree(folder: str | Path, ignore_errors: bool = False) -> None:
        opened = [os.readlink(f"/proc/self/fd/{number}") for number in os.listdir("/proc/self/fd") if _is_open(number)]
        if not any(path.startswith(f"{folder}/") for path in opened):
            remove(folder, ignore_errors=ignore_errors)
        elif not ignore_errors:
            raise OSError(errno.ENOTEMPTY, os.strerror(errno.ENOTEMPTY), str(folder))

    if not os.path.isdir("/proc/self/fd"):
        pytest.skip("there is no list of open files")
    monkeypatch.setattr(shutil, "rmtree", rmtree)
    parts = tmp_path / "map.parts"
    with pytest.raises(errors.ArgumentError, match="take another"), pieces.locked(parts, OWN):
        raise errors.ArgumentError("take another")
    assert list(tmp_path.iterdir()) == []
    with pieces.locked(parts, OWN):
        (parts / "piece-1").mkdir()
        pieces.remove(parts)
    assert list(tmp_path.iterdir()) == []


def _is_open(number: str) -> bool:
    return os.path.islink(f"/proc/self/fd/{number}")


@pytest.mark.parametrize("inner", ["", "0" * 32])
def test_a_piece_on_its_way_makes_no_folder_anew_that_was_taken_away(
    inner: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    points, pose = scans_of(3, count=1)[0]
    with voxtile.Map.create(tmp_path / "map", resolution=0.5, tile_size=4.0) as made:
        made.insert(points, matrix_of(pose))
    _voxtile.crop(tmp_path / "map", tmp_path / "made", [-99, -99, -99, 99, 99, 99], piece_of="1" * 32)
    parts = tmp_path / "out" / "map.parts"
    (parts / inner).mkdir(parents=True)
    move = pieces.move_piece

    def move_late(*given: str) -> None:
        pieces.remove(parts)
        move(*given)

    monkeypatch.setattr(pieces, "move_piece", move_late)
    with pytest.raises(FileNotFoundError, match="nobody waits for this piece"):
        pieces.hand_over(str(tmp_path / "made"), str(parts / inner / "piece"), "1" * 32)
    assert len(list((tmp_path / "out").iterdir())) == len(list((tmp_path / "out").glob("map.parts.gone-*"))) == 1


def test_an_attempt_leaves_nothing_of_its_own_or_of_those_before(tmp_path: Path) -> None:
    beside, before = tmp_path / "files.unfinished", "0" * 32
    (beside / before).mkdir(parents=True)
    with pytest.raises(KeyboardInterrupt), pieces.attempt_in(beside) as attempt:
        assert attempt.parent == beside and list(attempt.iterdir()) == []
        (attempt / "made").touch()
        raise KeyboardInterrupt
    assert list(tmp_path.iterdir()) == []
    with pieces.attempt_in(beside) as attempt:
        os.rename(attempt, tmp_path / "files")
    assert [path.name for path in tmp_path.iterdir()] == ["files"]
