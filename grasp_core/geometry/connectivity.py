"""Links points that are close to each other, and finds the sets that links connect.

Both are done with numpy, since importing scipy's graphs takes longer than planning a small object
does. Its search tree is used only where points are dense.
"""

import importlib
from typing import Any

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.errors import InputError

GENERAL = np.array([0.41421, 0.56714, 0.69315])
"""Direction of the line on which points are projected, perpendicular to no face that parts usually
have. It is shorter than one, so that projections are closer together than points."""
CROWDED = 64
"""Largest number of neighbours on the line that are compared with a point one by one."""
MOST_LINKS = 100
"""Largest number of links per point."""


def close_pairs(points: Array, reach: float) -> Indices:
    """List links between points within a distance of each other, as pairs of indices, (k, 2).

    Close points have close projections on a line, so only neighbours there are compared. Equal
    points are linked in a row, and only one of them is compared with other points.
    """
    shadows = ((points - points[0]) * GENERAL).sum(axis=1)
    order = np.argsort(shadows, kind="stable")
    equal = (points[order[1:]] == points[order[:-1]]).all(axis=1)
    links = [np.column_stack([order[:-1], order[1:]])[equal]]
    order = order[np.append(True, ~equal)]
    for step in range(1, len(order)):
        near = shadows[order[step:]] - shadows[order[:-step]] <= reach
        if not near.any():
            break
        if step > CROWDED:
            links.append(order[_pairs_of_tree(points[order], reach)])
            break
        pairs = np.column_stack([order[:-step][near], order[step:][near]])
        apart = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
        links.append(pairs[apart <= reach])
    return np.concatenate(links)


def _pairs_of_tree(points: Array, reach: float) -> Indices:
    spatial: Any = importlib.import_module("scipy.spatial")
    tree = spatial.KDTree(points)
    pairs = (int(tree.count_neighbors(tree, reach)) - len(points)) // 2
    if pairs > MOST_LINKS * len(points):
        raise InputError(
            f"{pairs} pairs of points are within {reach:.3g} of each other, more than {MOST_LINKS} "
            "per point; merge points that coincide first"
        )
    return np.asarray(tree.query_pairs(reach, output_type="ndarray"), dtype=np.int64)


def components(count: int, links: Indices) -> Indices:
    """Return for each item the least index among the items connected with it, (count,).

    Items point to items of their set, in the end to the least one. In each round the item that a
    linked one points to is made to point to the least one at the other ends, and then every item
    to the end of its way. Rounds grow as the square of the logarithm of `count` at most, and there
    are fifteen for a million items in a row of any order.

    Source:
        Liu and Tarjan, "Simple concurrent labeling algorithms for connected components", SOSA 2019.
    """
    least = np.arange(count)
    apart = links
    while len(apart):
        low, high = np.sort(apart, axis=1).T
        np.minimum.at(least, high, low)
        while not np.array_equal(further := least[least], least):
            least = further
        apart = least[apart]
        apart = apart[apart[:, 0] != apart[:, 1]]
    return least
