"""Minimum cuts: as cheap as the maximum flow that scipy finds, and known ones."""

import numpy as np
import pytest

from bakery.geometry.cut import minimum_cut


def cost(edges, capacity, source, sink, inside):
    split = inside[edges[:, 0]] != inside[edges[:, 1]]
    return capacity[split].sum() + source[~inside].sum() + sink[inside].sum()


def flow(edges, capacity, source, sink):
    sparse = pytest.importorskip("scipy.sparse")
    csgraph = pytest.importorskip("scipy.sparse.csgraph")
    count, every = len(source), np.arange(len(source))
    rows = np.concatenate([*edges.T, np.full(count, count), every])
    columns = np.concatenate([*edges.T[::-1], every, np.full(count, count + 1)])
    values = np.concatenate([capacity, capacity, source, sink]).astype(np.int32)
    table = sparse.coo_matrix((values, (rows, columns)), shape=(count + 2, count + 2))
    return csgraph.maximum_flow(table.tocsr(), count, count + 1).flow_value


@pytest.mark.parametrize("seed", range(60))
def test_a_cut_costs_what_flows(seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 60))
    edges = rng.integers(0, count, (int(rng.integers(1, 200)), 2))
    edges = edges[edges[:, 0] != edges[:, 1]]
    capacity = rng.integers(0, 20, len(edges))
    source, sink = (rng.integers(0, 30, count) * (rng.random(count) < 0.3) for _ in range(2))
    inside = minimum_cut(edges, capacity, source, sink)
    assert cost(edges, capacity, source, sink, inside) == flow(edges, capacity, source, sink)


def test_a_chain_is_cut_where_it_is_weakest():
    edges = np.stack([np.arange(4), np.arange(1, 5)], 1)
    source, sink = np.zeros((2, 5), int)
    source[0] = sink[4] = 100
    inside = minimum_cut(edges, np.array([5, 2, 7, 3]), source, sink)
    assert inside.tolist() == [True, True, False, False, False]


def test_what_no_terminal_reaches_is_outside():
    assert not minimum_cut(np.array([[0, 1]]), np.array([3]), np.zeros(2, int), [0, 1]).any()


@pytest.mark.parametrize(
    "given, message",
    [
        (([[0, 2]], [1], [1, 0], [0, 1]), "beyond 0 to 1"),
        (([[0, 1]], [-1], [1, 0], [0, 1]), "negative"),
        (([[0, 1]], [1, 2], [1, 0], [0, 1]), "a capacity an edge"),
    ],
)
def test_wrong_calls(given, message):
    with pytest.raises(ValueError, match=message):
        minimum_cut(*map(np.array, given))
