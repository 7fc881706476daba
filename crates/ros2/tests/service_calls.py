"""Tests the services of a node with the map of peer.py over any transport. The map is unchanged afterwards."""

import time

from octrees import binary_leaves, full_leaves, octets, voxels_of
from ros_messages import Point, Vector3

EVERYWHERE = Point(-1e3, -1e3, -1e3), Point(1e3, 1e3, 1e3)


def last_of(take, is_wanted):
    """Waits until the last received message is the wanted one, and returns it."""
    until, last = time.time() + 10, None
    while last is None or not is_wanted(last):
        assert time.time() < until, f"not the wanted message within 10 s: {last}"
        time.sleep(0.1)
        [*_, last] = [last, *take()]
    return last


def is_complete(diagnostics):
    """Returns whether the diagnostics report a map with 30 flushed scans, without losses."""
    [status] = diagnostics.status
    values = {value.key: value.value for value in status.values}
    is_whole = (status.level, values["scan_number"], values["unflushed_scans"]) == (0, "30", "0")
    is_somewhere = int(values["memory_bytes"]) > 0 and int(values["disk_bytes"]) > 0
    return is_whole and is_somewhere and float(values["flush_age_s"]) < 60


def check(call, send_malformed, published, diagnostics):
    """call: function of each service; send_malformed: sends malformed requests; the others return new messages."""

    def whole(binary=True):
        response = call["octomap_in_box"](*EVERYWHERE, binary)
        assert response.success, response.message
        data = octets(response.map.data)
        return voxels_of((binary_leaves if binary else full_leaves)(data)) if data else {}

    saved = call["save"]()
    assert saved.success and saved.message == "durable up to scan 30", saved
    before, before_full = whole(), whole(False)
    assert len(before) > 10000 and set(before) == set(before_full)
    assert before == {voxel: log_odds >= 0 for voxel, log_odds in before_full.items()}
    resolution = call["octomap_full"]().map.resolution
    for name, leaves in [("octomap_binary", binary_leaves), ("octomap_full", full_leaves)]:
        around = voxels_of(leaves(octets(call[name]().map.data)))
        assert 0 < len(around) < len(before) and set(around) < set(before)

    origin = Point(2.0, 0.7, 0.05)
    hit = call["cast_ray"](origin, Vector3(1.0, 0.0, 0.0), 0.0, False)
    assert hit.success and hit.hit and hit.distance > 1 and hit.probability > 0.5, hit
    place = [hit.center.x, hit.center.y, hit.center.z]
    assert before[tuple(round(at / resolution - 0.5) for at in place)]
    assert not call["cast_ray"](origin, Vector3(1.0, 0.0, 0.0), hit.distance - 0.2, False).hit
    touched = call["check_collision"](origin, hit.center, 0.05, False)
    assert touched.success and touched.hit
    assert not call["check_collision"](origin, origin, 0.2, False).hit
    for wrong in [Vector3(0.0, 0.0, 0.0), Vector3(float("nan"), 0.0, 0.0)]:
        answer = call["cast_ray"](origin, wrong, 0.0, False)
        assert not answer.success and answer.message

    def distances(corner, size, spheres=()):
        radii = [1.0] * len(spheres)
        return call["get_esdf_and_gradient"](True, False, True, "", corner, size, [], [], list(spheres), radii)

    low = Point(*(at - 0.45 for at in place))
    field = distances(low, Vector3(0.9, 0.9, 0.9))
    shape = [dim.size for dim in field.esdf_and_gradients.layout.dim]
    data = field.esdf_and_gradients.data
    assert field.success and [dim.label for dim in field.esdf_and_gradients.layout.dim] == ["x", "y", "z"]
    assert len(data) == shape[0] * shape[1] * shape[2] and abs(field.voxel_size_m - resolution) < 1e-6
    first = [field.origin_m.x, field.origin_m.y, field.origin_m.z]
    x, y, z = (round((at - low) / resolution - 0.5) for at, low in zip(place, first))
    # Inside of the obstacle; unknown voxels are -1000.
    assert data[(x * shape[1] + y) * shape[2] + z] < 0 and {-1000.0} < set(data)
    assert all(value == -1000 or abs(value) <= 2.0 for value in data)
    assert not distances(low, Vector3(0.0, 1.0, 1.0)).success
    assert not distances(low, Vector3(1.0, 1.0, 1.0), [low]).success

    # The name of a snapshot can be reused for the same state, but not for another one.
    assert call["snapshot"]("before").success
    assert call["snapshot"]("before").success
    assert not call["snapshot"]("../out").success
    assert not call["revert"]("never").success
    send_malformed()

    corner = Point(-1e3, -1e3, 0.5)
    call["clear_bbox"](corner, EVERYWHERE[1])
    below = {voxel: occupied for voxel, occupied in before.items() if voxel[2] < 5}
    assert whole() == below and 0 < len(below) < len(before)
    assert not call["snapshot"]("before").success
    # An inverted box changes nothing.
    call["clear_bbox"](EVERYWHERE[1], corner)
    assert whole() == below
    call["reset"]()
    assert whole() == {}
    # Cleared voxels are not published any more; reverted ones are.
    last_of(published, lambda octree: len(octree.data) == 0)
    reverted = call["revert"]("before")
    assert reverted.success, reverted
    assert whole(False) == before_full
    last_of(published, lambda octree: len(octree.data) > 0)
    last_of(diagnostics, is_complete)
    print(f"services: {len(before)} voxels, {len(below)} below, hit at {hit.distance:.2f} m")
