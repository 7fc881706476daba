"""Receives the node's outputs with an independent peer (Cyclone DDS) and compares them with exports.

outputs.py listen DOMAIN FILE SECONDS [TOPIC ...]   writes the last message and the number of messages of each topic;
                                                    changes are accumulated
outputs.py compare FILE ALL.csv MAP.pgm CLOUDS RADIUS MAX_Z live|rest RANGE
                                                    compares them with the output of `voxtile export`
outputs.py whole FILE ALL.csv   compares octomap_full, of a box around the whole map
outputs.py colours FILE OCCUPIED.csv   compares the colours of octomap_point_cloud_centers
"""

import csv
import json
import sys
import time

import numpy as np
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from definitions import typestore
from frontier_outputs import compare_frontiers, plain_markers
from octrees import binary_leaves, full_leaves, octets, voxels_of
from ros_messages import LATCHED, RELIABLE, MarkerArray, OccupancyGrid, Octomap, PointCloud2, PoseArray

TYPES = {
    "octomap_binary": (Octomap, "octomap_msgs/msg/Octomap"),
    "octomap_full": (Octomap, "octomap_msgs/msg/Octomap"),
    "octomap_point_cloud_centers": (PointCloud2, "sensor_msgs/msg/PointCloud2"),
    "occupied_cells_vis_array": (MarkerArray, "visualization_msgs/msg/MarkerArray"),
    "projected_map": (OccupancyGrid, "nav_msgs/msg/OccupancyGrid"),
    "octomap_point_cloud_changes": (PointCloud2, "sensor_msgs/msg/PointCloud2"),
    "local_occupied": (PointCloud2, "sensor_msgs/msg/PointCloud2"),
    "local_inflated": (PointCloud2, "sensor_msgs/msg/PointCloud2"),
    "distance_field": (PointCloud2, "sensor_msgs/msg/PointCloud2"),
    "frontiers": (MarkerArray, "visualization_msgs/msg/MarkerArray"),
    "frontier_goals": (PoseArray, "geometry_msgs/msg/PoseArray"),
}


CHANGES = "octomap_point_cloud_changes"


class Viewer:
    """Accumulates changes."""

    def __init__(self):
        self.occupied, self.points = set(), []

    def take(self, message):
        assert [field.name for field in message.fields] == ["x", "y", "z", "state"]
        layout = {"names": ["at", "state"], "formats": ["3<f4", "u1"], "offsets": [0, 12], "itemsize": 16}
        rows = np.frombuffer(octets(message.data), layout)
        assert len(rows) == message.width * message.height
        assert {int(state) for state in rows["state"]} <= {0, 1, 2}
        for at, state in zip(rows["at"].tolist(), rows["state"].tolist()):
            if state == 1:
                self.occupied.add(tuple(at))
            else:
                self.occupied.discard(tuple(at))
        self.points.append(len(rows))
        return {"frame": message.header.frame_id, "points": sorted(self.occupied), "changes": self.points}


def plain(name, message):
    """Converts a message to numbers and strings."""
    if name == "occupied_cells_vis_array":
        [marker] = message.markers
        points = [[point.x, point.y, point.z] for point in marker.points]
        scale = [marker.scale.x, marker.scale.y, marker.scale.z]
        frame = marker.header.frame_id
        return {"frame": frame, "type": marker.type, "action": marker.action, "scale": scale, "points": points}
    if name == "frontiers":
        return {"frame": message.markers[0].header.frame_id, "markers": plain_markers(message)}
    if name == "frontier_goals":
        places = [pose.position for pose in message.poses]
        return {"frame": message.header.frame_id, "points": [[place.x, place.y, place.z] for place in places]}
    if TYPES[name][0] is PointCloud2:
        names = ["x", "y", "z", "distance"][: 4 if name == "distance_field" else 3]
        found = [field.name for field in message.fields]
        assert found in (names, [*names, "rgb"])
        points = np.frombuffer(octets(message.data), "<f4").reshape(-1, len(found))
        assert len(points) == message.width * message.height
        colours = {"colours": points[:, -1].copy().view("<u4").tolist()} if found[-1] == "rgb" else {}
        return {"frame": message.header.frame_id, "points": points[:, : len(names)].astype(float).tolist(), **colours}
    if name == "projected_map":
        info = message.info
        origin = info.origin.position
        size = [info.width, info.height]
        cells = [int(cell) for cell in message.data]
        place = {"origin": [origin.x, origin.y, origin.z], "turn": info.origin.orientation.w}
        return {"frame": message.header.frame_id, "size": size, "cells": cells, **place}
    head = {"frame": message.header.frame_id, "binary": message.binary, "id": message.id}
    return {**head, "resolution": message.resolution, "data": octets(message.data).hex()}


class Taken:
    """Last message and number of messages of each topic."""

    def __init__(self):
        self.got, self.viewer, self.store = {}, Viewer(), typestore()

    def take(self, name, message, cdr):
        # Check that rosbags decodes the message with ROS's definitions, too.
        own = name.split("/")[-1]
        self.store.deserialize_cdr(cdr, TYPES[own][1])
        count = self.got.get(name, {"count": 0})["count"] + 1
        content = self.viewer.take(message) if own == CHANGES else plain(own, message)
        self.got[name] = {"count": count, "message": content}

    def write(self, file):
        with open(file, "w") as out:
            json.dump(self.got, out)


def listen(domain, file, seconds, topics):
    participant = DomainParticipant(domain)
    readers, taken = {}, Taken()
    for name in topics or TYPES:
        qos = Qos(RELIABLE, LATCHED, Policy.History.KeepLast(100 if name == CHANGES else 1))
        kind = TYPES[name.split("/")[-1]][0]
        readers[name] = DataReader(participant, Topic(participant, "rt/" + name, kind), qos=qos)
    until = time.time() + seconds
    while time.time() < until:
        for name, reader in readers.items():
            for message in reader.take(10):
                if hasattr(message, "serialize"):
                    taken.take(name, message, bytes(message.serialize()))
        time.sleep(0.02)
    taken.write(file)


def pgm_cells(path):
    """Reads an image for nav2 as cells of a message, from the lowest row up."""
    data = open(path, "rb").read()
    magic, size, most, pixels = data.split(b"\n", 3)
    assert (magic, most) == (b"P5", b"255")
    width, height = map(int, size.split())
    rows = np.frombuffer(pixels, np.uint8).reshape(height, width)[::-1]
    states = {0: 100, 254: 0, 205: -1}
    return [width, height], [states[int(pixel)] for pixel in rows.flatten()]


def last_position(clouds):
    """Returns the sensor position at the last cloud of peer.py."""
    ticks = 5 * (clouds - 1) + 0.35
    yaw = 0.02 * ticks
    x, y = 0.2 * np.cos(yaw) - 0.5 * np.sin(yaw), 0.2 * np.sin(yaw) + 0.5 * np.cos(yaw)
    return [1.0 + 0.01 * ticks + x, 0.5 + 0.5 + y, 0.0]


INFLATION_M = 0.2


def compare_local(got, occupied, centers, origin, radius, moment, inflation_range, resolution):
    """Checks the local map: inflated voxels are within the radius of occupied voxels near the sensor. After a start it
    equals the map near the sensor."""
    local, inflated = (
        {tuple(round(at / resolution - 0.5) for at in point) for point in got[name]["points"]}
        for name in ["local_occupied", "local_inflated"]
    )
    if moment == "rest":
        near = {index for index in occupied if np.linalg.norm(np.subtract(centers[index], origin)) <= radius}
        assert local == near, f"{len(local)} voxels in the local map, but {len(near)} in this part of the map"
    else:
        assert len(local) > 100 and len(local & occupied) > 0.8 * len(local), "the local map differs"
    reach = int(INFLATION_M / resolution + 1)
    cube = [np.array([x, y, z]) for x, y, z in np.ndindex(*[2 * reach + 1] * 3)]
    ball = [at - reach for at in cube if np.linalg.norm(at - reach) * resolution <= INFLATION_M * (1 + 1e-9)]
    center = {index: (np.array(index) + 0.5) * resolution for index in local}
    sources = [index for index in local if np.linalg.norm(center[index] - origin) <= inflation_range]
    assert 0 < len(sources) < len(local)
    wanted = {tuple(int(at) for at in np.add(index, offset)) for index in sources for offset in ball} | local
    # Voxels near the border of the box may be inflated from outside, so they are not compared.
    inner = [np.ceil((origin[k] - radius + INFLATION_M) / resolution) for k in range(3)]
    outer = [np.floor((origin[k] + radius - INFLATION_M) / resolution) - 1 for k in range(3)]
    wanted, found = (
        {index for index in indices if all(inner[k] <= index[k] <= outer[k] for k in range(3))}
        for indices in [wanted, inflated]
    )
    assert found == wanted, f"{len(found)} inflated voxels instead of {len(wanted)}"
    return f"{len(local)} voxels in the local map and {len(inflated)} inflated"


def compare_distances(got, log_odds, occupied, centers, origin, radius, resolution):
    """Checks distances whose nearest obstacle must be in this part of the map against a brute force."""
    obstacles = np.array([centers[index] for index in occupied])
    checked = 0
    for *point, distance in got["distance_field"]["points"][::97]:
        if np.abs(np.subtract(point, origin)).max() + distance >= radius - resolution:
            continue
        assert tuple(round(at / resolution - 0.5) for at in point) in log_odds, f"unknown voxel at {point}"
        expected = np.linalg.norm(obstacles - point, axis=1).min()
        assert abs(distance - expected) < 1e-4, f"{distance} m at {point}, not {expected}"
        checked += 1
    assert checked > 20, f"only {checked} distances"


def compare(file, all_csv, pgm, origin, radius, max_z, moment, inflation_range):
    got = {name: one["message"] for name, one in json.load(open(file)).items()}
    assert set(got) == set(TYPES), f"received only {sorted(got)}"
    assert all(one["frame"] == "map" for one in got.values())
    resolution = got["octomap_full"]["resolution"]
    log_odds, centers = {}, {}
    for row in csv.DictReader(open(all_csv)):
        center = [float(row[axis]) for axis in "xyz"]
        if not all(origin[k] - radius <= center[k] < origin[k] + radius for k in range(3)):
            continue
        index = tuple(round(at / resolution - 0.5) for at in center)
        log_odds[index], centers[index] = float(row["log_odds"]), center
    occupied = {index for index, value in log_odds.items() if value >= 0}
    assert len(occupied) > 100 and len(log_odds) > len(occupied)

    binary, full = got["octomap_binary"], got["octomap_full"]
    assert (binary["binary"], full["binary"], binary["id"], full["id"]) == (True, False, "OcTree", "OcTree")
    found = voxels_of(binary_leaves(bytes.fromhex(binary["data"])))
    assert found == {index: index in occupied for index in log_odds}, "octomap_binary differs"
    found = voxels_of(full_leaves(bytes.fromhex(full["data"])))
    assert found == {index: float(np.float32(value)) for index, value in log_odds.items()}, "octomap_full differs"

    low = sorted(index for index in occupied if centers[index][2] - resolution / 2 < max_z)
    assert 0 < len(low) < len(occupied)
    for name in ["octomap_point_cloud_centers", "occupied_cells_vis_array", CHANGES]:
        points = [tuple(round(at / resolution - 0.5) for at in point) for point in got[name]["points"]]
        assert sorted(points) == low, f"{name} has {len(points)} voxels, the map {len(low)}"
    changes = got[CHANGES]["changes"]
    assert moment == "rest" or max(changes[5:], default=len(low)) < len(low) / 2, f"too many changes: {changes}"
    markers = got["occupied_cells_vis_array"]
    assert (markers["type"], markers["action"], markers["scale"]) == (6, 0, [resolution] * 3)

    grid = got["projected_map"]
    size, cells = pgm_cells(pgm)
    assert (grid["size"], grid["turn"]) == (size, 1.0), f"{grid['size']} cells, but the image has {size}"
    assert grid["cells"] == cells, "projected_map differs"
    corner = [float(at) for at in open(pgm.replace(".pgm", ".yaml")).read().split("origin: [")[1].split(",")[:2]]
    assert grid["origin"] == [*corner, 0.0], f"{grid['origin']} and {corner}"
    compare_distances(got, log_odds, occupied, centers, origin, radius, resolution)
    frontiers = compare_frontiers(got, all_csv, origin, resolution)
    local = compare_local(got, occupied, centers, origin, radius, moment, inflation_range, resolution)
    print(
        f"outputs: {len(log_odds)} voxels, {local}, {len(low)} of {len(occupied)} occupied ones below, {size} cells, "
        f"{frontiers} frontiers"
    )


def compare_whole(file, all_csv):
    got = json.load(open(file))["octomap_full"]["message"]
    resolution, log_odds = got["resolution"], {}
    for row in csv.DictReader(open(all_csv)):
        index = tuple(round(float(row[axis]) / resolution - 0.5) for axis in "xyz")
        log_odds[index] = float(np.float32(float(row["log_odds"])))
    assert voxels_of(full_leaves(bytes.fromhex(got["data"]))) == log_odds, "octomap_full differs"
    print(f"outputs: {len(log_odds)} voxels in octomap_full")


def compare_colours(file, occupied_csv):
    got = json.load(open(file))["octomap_point_cloud_centers"]["message"]
    published = {tuple(np.round(at, 3).tolist()): colour for at, colour in zip(got["points"], got["colours"])}
    exported = {}
    for row in csv.DictReader(open(occupied_csv)):
        at = tuple(round(float(row[axis]), 3) for axis in "xyz")
        red, green, blue = (int(row[name] or 255) for name in ["red", "green", "blue"])
        exported[at] = red << 16 | green << 8 | blue
    assert published == exported, "the colours differ"
    print(f"outputs: {len(exported)} voxels with {len(set(exported.values()))} colours")


def main():
    if sys.argv[1] == "whole":
        compare_whole(*sys.argv[2:4])
    elif sys.argv[1] == "colours":
        compare_colours(*sys.argv[2:4])
    elif sys.argv[1] == "listen":
        listen(int(sys.argv[2]), sys.argv[3], float(sys.argv[4]), sys.argv[5:])
    else:
        radius, max_z = map(float, sys.argv[6:8])
        moment, inflation_range = sys.argv[8], float(sys.argv[9])
        compare(*sys.argv[2:5], last_position(int(sys.argv[5])), radius, max_z, moment, inflation_range)


if __name__ == "__main__":
    main()
