"""Reads OctoMap's octrees from messages, according to OctoMap's sources and independent of the library under test."""

import struct

import numpy as np

DEPTH = 16


def octets(data):
    return bytes(np.asarray(data, np.int64).astype(np.uint8))


def binary_leaves(data):
    """Returns the leaves of a tree in binary form: key of the lowest voxel, depth, whether it is occupied."""
    at, leaves = 0, []

    def node(key, depth):
        nonlocal at
        (bits,) = struct.unpack_from("<H", data, at)
        at += 2
        inner = []
        for child in range(8):
            half = 1 << (DEPTH - depth - 1)
            below = [key[k] + half * (child >> k & 1) for k in range(3)]
            # Two bits per child: 01 is free, 10 is occupied, 11 is an inner node.
            state = bits >> (2 * child) & 3
            if state == 3:
                inner.append(below)
            elif state:
                leaves.append((below, depth + 1, state == 2))
        for below in inner:
            node(below, depth + 1)

    node([0, 0, 0], 0)
    assert at == len(data), "octets are left over"
    return leaves


def full_leaves(data):
    """Returns the leaves of a tree with log-odds: key of the lowest voxel, depth, log-odds."""
    at, leaves = 0, []

    def node(key, depth):
        nonlocal at
        log_odds, children = struct.unpack_from("<fB", data, at)
        at += 5
        if not children:
            leaves.append((key, depth, log_odds))
        for child in range(8):
            if children >> child & 1:
                half = 1 << (DEPTH - depth - 1)
                node([key[k] + half * (child >> k & 1) for k in range(3)], depth + 1)

    node([0, 0, 0], 0)
    assert at == len(data), "octets are left over"
    return leaves


def voxels_of(leaves):
    """Returns the value of each voxel by its index."""
    voxels = {}
    for key, depth, value in leaves:
        edge = range(1 << (DEPTH - depth))
        for x in edge:
            for y in edge:
                for z in edge:
                    voxels[key[0] + x - 32768, key[1] + y - 32768, key[2] + z - 32768] = value
    return voxels
