"""Properties of simulated plans, for any costs."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest
from voxtile import errors

pytest.importorskip("distributed")
plan = pytest.importorskip("voxtile.dask.simulation")
regions = pytest.importorskip("voxtile.dask.regions")

CITY = plan.City(streets_km=60.0)


def _plan(**changed: object) -> dict[str, object]:
    how = {"region_size": 300.0, "reach": 60.0, "workers": [1, 4, 50, 1000], **changed}
    city = how.pop("city", CITY)
    return plan.simulate(city, **how)


def test_more_workers_take_no_longer_and_no_less_than_their_share() -> None:
    found = _plan()
    rows = found["workers"]
    for fewer, more in zip(rows, rows[1:], strict=False):
        assert more["seconds"] < fewer["seconds"]
    alone = found["cpu_seconds"]["map"]
    assert rows[0]["map_seconds"] == pytest.approx(alone)
    for row in rows:
        least = max(alone / row["workers"], found["longest_task_seconds"])
        most = least + alone / row["workers"] + found["longest_task_seconds"]
        assert least <= row["map_seconds"] * (1 + 1e-9) <= most


def test_smaller_regions_read_more_and_map_the_same() -> None:
    free = plan.Costs(task_s=0.0, read_scan_s=0.0, shard_tile_s=0.0)
    found = [_plan(region_size=size, costs=free) for size in (200.0, 400.0, 800.0)]
    assert [row["overlap"] for row in found] == sorted((row["overlap"] for row in found), reverse=True)
    assert all(row["overlap"] >= 1 for row in found)
    # Each scan is mapped once, independent of the borders.
    for row in found:
        assert row["cpu_seconds"]["map"] == pytest.approx(row["scans"] * free.map_scan_s)
        assert row["bytes_read"] == (row["scans_read"] + row["scans"]) * free.scan_bytes


def test_a_dense_downtown_makes_tasks_uneven() -> None:
    even, dense = _plan(), _plan(city=plan.City(streets_km=60.0, downtown_times=10))
    assert dense["scans"] > 1.5 * even["scans"] and dense["skew"] > 2 * even["skew"]
    assert even["skew"] < 3


def test_streets_have_the_requested_length() -> None:
    for kilometres in (10.0, 60.0, 250.0):
        assert _plan(city=plan.City(streets_km=kilometres))["scans"] == pytest.approx(kilometres * 1000, rel=0.2)


def test_the_advised_size_is_the_smallest_within_the_goal() -> None:
    costs = plan.Costs(plan_scan_s=0.001, read_scan_s=0.001, map_scan_s=0.01)
    for reach in (20.0, 60.0, 150.0):
        size = plan.advised_region_size(reach, 10.0, costs)
        assert plan.cpu_factor(size, reach, costs) <= 1.3
        assert size == 200.0 or plan.cpu_factor(size - 100.0, reach, costs) > 1.3
    # Reading dominates: no size reaches the goal, but one is returned.
    hopeless = plan.Costs(plan_scan_s=1.0, read_scan_s=1.0, map_scan_s=0.0)
    assert 200.0 <= plan.advised_region_size(60.0, 10.0, hopeless) <= 10_000.0


def test_scans_between_two_visits_are_skipped() -> None:
    here, there = (1.0, 1.0, 2.0, 2.0), (901.0, 1.0, 902.0, 2.0)
    boxes = [here] * 5 + [there] * 100 + [None] + [here] * 7
    columns = regions.columns_of(boxes, 100.0, 0.5)
    assert columns == {(0, 0): [(0, 5), (106, 113)], (9, 0): [(5, 105)]}
    # A short gap is read, because reopening the map takes longer.
    columns = regions.columns_of([here, *[there] * regions.JOINED_GAP_SCANS, here], 100.0, 0.5)
    assert columns[0, 0] == [(0, regions.JOINED_GAP_SCANS + 2)]


def test_columns_partition_the_tiles() -> None:
    for size, tile_size in ((53.0, 10.0), (40.0, 10.0), (7.0, 2.0)):
        boxes = [regions.tiles_of((x, -1), size, tile_size) for x in range(-3, 3)]
        for west, east in zip(boxes, boxes[1:], strict=False):
            assert west[3] == east[0] and west[0] < west[3]
        for x, box in zip(range(-3, 3), boxes, strict=True):
            region = regions.region_of((x, -1), size)
            assert region[0] <= box[0] + tile_size / 2 < region[3]
            assert region[0] <= box[3] - tile_size / 2 < region[3]


def test_every_tile_is_in_one_column_and_its_range() -> None:
    for tile_size in (0.3, 1.2, 2.0, 3.3, 6.4, 10.0, 12.8):
        for tenths in range(20, 60, 3):
            size = round(tenths * tile_size / 10, 9)
            for tile in range(-60, 60):
                column, _ = regions.column_of((tile, 0), size, tile_size)
                boxes = {x: regions.tiles_of((x, 0), size, tile_size) for x in range(column - 1, column + 2)}
                center = (tile + 0.5) * tile_size
                assert [x for x, box in boxes.items() if box[0] < center < box[3]] == [column], (tile_size, size, tile)


def test_a_plan_of_too_many_columns_names_the_scan() -> None:
    boxes = [(0.0, 0.0, 1.0, 1.0), None, (0.0, 0.0, 1e5, 1e5)]
    with pytest.raises(errors.ArgumentError, match=r"^scan 2: .*more than 1000 regions of 100\.0 m"):
        regions.columns_of(boxes, 100.0, 0.5, most=1000)
    assert len(regions.columns_of(boxes[:2], 100.0, 0.5, most=4)) == 4


def test_the_command_prints_the_plan() -> None:
    command = [sys.executable, "-m", "voxtile.dask.plan", "--streets-km=20", "--workers", "2", "3"]
    found = json.loads(subprocess.check_output([*command, "--json"], text=True))
    assert [row["workers"] for row in found["workers"]] == [2, 3]
    assert found["region_size"] == plan.advised_region_size(60.0, 10.0)
    assert f"{found['tasks']} tasks" in subprocess.check_output(command, text=True)
    for wrong in ("--streets-km=0", "--max-range=nan", "--workers=0", "--region-size=-1"):
        done = subprocess.run([*command, wrong], capture_output=True, text=True, check=False)
        assert done.returncode == 2 and done.stderr.startswith("error: "), wrong
