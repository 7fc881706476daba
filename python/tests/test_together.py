"""Inserts of several scans at once."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import voxtile
from conftest import scans_of


def test_lists_and_generators_make_the_same_map(tmp_path: Path) -> None:
    scans = scans_of(5, count=40, points=300)

    def by_one_buffer() -> Iterator[tuple[np.ndarray, np.ndarray]]:
        buffer = np.empty_like(scans[0][0])
        for points, pose in scans:
            buffer[:] = points
            yield buffer, pose

    with (
        voxtile.Map.create(tmp_path / "one_by_one", 0.1) as one_by_one,
        voxtile.Map.create(tmp_path / "listed", 0.1) as listed,
        voxtile.Map.create(tmp_path / "generated", 0.1) as generated,
    ):
        reports = [one_by_one.insert(points, pose) for points, pose in scans]
        of_list = listed.insert_many(scans)
        of_generator = generated.insert_many(by_one_buffer())
        assert of_list.hits == of_generator.hits == sum(report.hits for report in reports)
        assert listed.scan_number == generated.scan_number == 40
        assert listed.digest() == generated.digest() == one_by_one.digest()


def test_scans_before_a_wrong_one_are_in_the_map(tmp_path: Path) -> None:
    scans = scans_of(6, count=6, points=300)
    wrong = [*scans[:3], (np.zeros((4, 2)), scans[3][1]), *scans[4:]]
    few = [*scans[:2], (*scans[2], np.ones(7, np.float32)), *scans[3:]]
    with voxtile.Map.create(tmp_path / "map", 0.1) as found:
        with pytest.raises(ValueError, match="N x 3"):
            found.insert_many(wrong)
        assert found.scan_number == 3
        with pytest.raises(ValueError, match="7 for 300 points"):
            found.insert_many(few)
        assert found.scan_number == 5
