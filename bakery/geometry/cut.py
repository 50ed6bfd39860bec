"""Minimum cut of a graph whose edges work both ways.

`minimum_cut` grows a tree from each terminal and keeps both between augmentations; it compiles once with
numba. The tests hold its cuts to the maximum flow that scipy finds.

References:
    Boykov and Kolmogorov, "An Experimental Comparison of Min-Cut/Max-Flow Algorithms for Energy
    Minimization in Vision", PAMI 26(9), 2004, section 3.
"""

import numba
import numpy as np

SURELY = 1 << 40  # capacity that is never cut
FREE, TERMINAL, ORPHAN = -1, -2, -3  # in place of a parent
SOURCE, SINK = 1, 2  # trees
FAR = 1 << 60


def minimum_cut(
    edges: np.ndarray, capacity: np.ndarray, source: np.ndarray, sink: np.ndarray
) -> np.ndarray:
    """The nodes on the source's side of a cut of least capacity.

    Args:
        edges: [M, 2] int, nodes that each edge joins; no node with itself.
        capacity: [M] int >= 0, of each edge in both directions.
        source: [N] int >= 0, capacity from the source to each node; sink: [N], to the sink.

    Returns:
        [N] bool. Of several least cuts the one with the fewest nodes.

    Raises:
        ValueError: a negative capacity, or edges that do not go with the nodes.
    """
    edges, count = np.asarray(edges, np.int64).reshape(-1, 2), len(source)
    if len(edges) and not (0 <= edges.min() and edges.max() < count):
        raise ValueError(f"minimum_cut: edges name nodes beyond 0 to {count - 1}")
    if min(np.min(x, initial=0) for x in (capacity, source, sink)) < 0:
        raise ValueError("minimum_cut: capacities must not be negative")
    if not len(capacity) == len(edges) or len(sink) != count:
        raise ValueError("minimum_cut: needs a capacity an edge, and two a node")
    ends = np.concatenate([edges[:, 0], edges[:, 1]])
    order = np.argsort(ends, kind="stable")
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    heads = np.concatenate([edges[:, 1], edges[:, 0]])[order].astype(np.int32)
    sister = np.roll(place, len(edges))[order].astype(np.int32)
    start = np.zeros(count + 1, np.int64)
    np.cumsum(np.bincount(ends, minlength=count), out=start[1:])
    residual = np.tile(np.asarray(capacity, np.int64), 2)[order]
    terminal = np.asarray(source, np.int64) - np.asarray(sink, np.int64)
    found: np.ndarray = _cut(start, heads, sister, residual, terminal)
    return found


@numba.njit(cache=True, nogil=True)
def _cut(start, heads, sister, residual, terminal):
    """`residual` [2 M] of arcs in the order of `start`, `terminal` [N] > 0 from the source; both used up."""
    count = len(terminal)
    tree, parent = np.zeros(count, np.int8), np.full(count, FREE, np.int32)
    stamp, distance = np.zeros(count, np.int64), np.zeros(count, np.int64)
    queue, waits = np.empty(count + 1, np.int32), np.zeros(count, np.bool_)
    begin, end = 0, 0
    orphans = np.empty(16, np.int32)
    for i in range(count):
        if terminal[i] != 0:
            tree[i] = SOURCE if terminal[i] > 0 else SINK
            parent[i], distance[i] = TERMINAL, 1
            queue[end], waits[i], end = i, True, end + 1
    now, current = 0, -1
    while True:
        i = current
        if i < 0 or parent[i] == FREE:
            i = -1
            while begin != end and i < 0:
                i, begin = queue[begin], (begin + 1) % (count + 1)
                waits[i] = False
                if parent[i] == FREE:
                    i = -1
            if i < 0:
                break
        bridge, mine = -1, tree[i]
        for a in range(start[i], start[i + 1]):
            if (residual[a] if mine == SOURCE else residual[sister[a]]) <= 0:
                continue
            j = heads[a]
            if parent[j] == FREE:
                tree[j], parent[j] = mine, sister[a]
                stamp[j], distance[j] = stamp[i], distance[i] + 1
                if not waits[j]:
                    queue[end], waits[j], end = j, True, (end + 1) % (count + 1)
            elif tree[j] != mine:
                bridge = a if mine == SOURCE else sister[a]
                break
            elif stamp[j] <= stamp[i] and distance[j] > distance[i]:
                parent[j], stamp[j], distance[j] = sister[a], stamp[i], distance[i] + 1
        now += 1
        if bridge < 0:
            current = -1
            continue
        current = i
        orphans, left = _augment(bridge, heads, sister, residual, terminal, parent, orphans)
        first = 0
        while first < left:
            i = orphans[first]
            first += 1
            mine = tree[i]
            best, least = -1, FAR
            for a in range(start[i], start[i + 1]):
                j = heads[a]
                if tree[j] != mine or parent[j] == FREE:
                    continue
                if (residual[sister[a]] if mine == SOURCE else residual[a]) <= 0:
                    continue
                far = _from_root(j, heads, parent, stamp, distance, now)
                if far < least:
                    best, least = a, far
            if best >= 0:
                parent[i], stamp[i], distance[i] = best, now, least + 1
                continue
            parent[i] = FREE
            for a in range(start[i], start[i + 1]):
                j = heads[a]
                if tree[j] != mine or parent[j] == FREE:
                    continue
                if (residual[sister[a]] if mine == SOURCE else residual[a]) > 0 and not waits[j]:
                    queue[end], waits[j], end = j, True, (end + 1) % (count + 1)
                if parent[j] >= 0 and heads[parent[j]] == i:
                    parent[j] = ORPHAN
                    orphans = _room(orphans, left)
                    orphans[left], left = j, left + 1
    return (tree == SOURCE) & (parent != FREE)


@numba.njit(cache=True, nogil=True)
def _room(orphans, left):
    if left < len(orphans):
        return orphans
    larger = np.empty(2 * len(orphans), np.int32)
    larger[:left] = orphans
    return larger


@numba.njit(cache=True, nogil=True)
def _augment(bridge, heads, sister, residual, terminal, parent, orphans):
    """Push what fits along the path over an arc that joins both trees; nodes cut off by it are orphans."""
    most = residual[bridge]
    for side in range(2):
        i = heads[sister[bridge]] if side == 0 else heads[bridge]
        while parent[i] != TERMINAL:
            up = parent[i]
            most = min(most, residual[sister[up]] if side == 0 else residual[up])
            i = heads[up]
        most = min(most, abs(terminal[i]))
    residual[bridge] -= most
    residual[sister[bridge]] += most
    left = 0
    for side in range(2):
        i = heads[sister[bridge]] if side == 0 else heads[bridge]
        while parent[i] != TERMINAL:
            up = parent[i]
            used, other = (sister[up], up) if side == 0 else (up, sister[up])
            residual[used] -= most
            residual[other] += most
            if residual[used] == 0:
                parent[i] = ORPHAN
                orphans = _room(orphans, left)
                orphans[left], left = i, left + 1
            i = heads[up]
        terminal[i] += -most if side == 0 else most
        if terminal[i] == 0:
            parent[i] = ORPHAN
            orphans = _room(orphans, left)
            orphans[left], left = i, left + 1
    return orphans, left


@numba.njit(cache=True, nogil=True)
def _from_root(node, heads, parent, stamp, distance, now):
    """Steps from a node to the terminal of its tree, FAR if an orphan lies between."""
    far, k = 0, node
    while stamp[k] != now:
        far += 1
        if parent[k] == TERMINAL:
            stamp[k], distance[k] = now, 1
            break
        if parent[k] < 0:
            return FAR
        k = heads[parent[k]]
    else:
        far += distance[k]
    total, k = far, node
    while stamp[k] != now:
        stamp[k], distance[k] = now, far
        far -= 1
        k = heads[parent[k]]
    return total
