"""Reference for the enumeration of spanning quadruples, pair by pair in NumPy."""

from itertools import combinations

import numpy as np

from grasp_core.cones.spanning import SpanningQuadruples, triple_sine


def spanning_by_pairs(normals, least):
    """List all quadruples that span above a least sine.

    A table of signed triple sines decides each quadruple. With i < j fixed, the faces fall
    into those to the left of the plane (i, j) and those to its right; a positively spanning
    quadruple takes one of each, so only those pairs are tested, as one array operation.
    """
    count = len(normals)
    table = np.array([triple_sine(normal, normals[:, None], normals[None]) for normal in normals])
    found = []
    sines = []
    for i, j in combinations(range(count), 2):
        left = j + 1 + np.flatnonzero(table[i, j, j + 1 :] > least)
        right = j + 1 + np.flatnonzero(table[i, j, j + 1 :] < -least)
        if not (left.size and right.size):
            continue
        a, b = left[:, None], right[None, :]
        sine = np.minimum(
            np.minimum(table[i, a, b], table[j, b, a]),
            np.minimum(table[i, j, a], table[j, i, b]),
        )
        rows, columns = np.nonzero(sine > least)
        pair = np.sort(np.column_stack([left[rows], right[columns]]), axis=1)
        found.append(np.column_stack([np.full((len(pair), 2), (i, j)), pair]))
        sines.append(sine[rows, columns])
    if not found:
        return SpanningQuadruples(np.empty((0, 4), dtype=np.int64), np.empty(0))
    indices, sine = np.concatenate(found), np.concatenate(sines)
    order = np.lexsort(indices.T[::-1])
    return SpanningQuadruples(indices[order], np.arcsin(sine[order]))
