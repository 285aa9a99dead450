"""Decides for many quadruples of vectors at once what `spanning` decides for one.

Numbers in comments are those of its derivation.
"""

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array
from grasp_core.cones.spanning import DEPENDENT, SIGNS, signed_determinants, triple_sine
from grasp_core.values import FINGERS

TRIPLES = np.array(list(combinations(range(FINGERS), 3)))
"""Indices of three of four vectors, (4, 3)."""


def span_angles(normals: Array) -> Array:
    """Find the span angle of many quadruples of unit vectors (q, 4, 3), (q,) [rad].

    Gives theta* of each; 0.0 where the vectors do not positively span R^3.
    """
    triples = normals[:, TRIPLES]
    # (2), the minimum over signs being taken in `triple_sine`
    sines = np.abs(triple_sine(triples[:, :, 0], triples[:, :, 1], triples[:, :, 2]))
    least = sines.min(axis=1, initial=1.0)
    return np.where(each_positively_spans(normals), np.arcsin(least), 0.0)


def each_positively_spans(vectors: Array) -> NDArray[np.bool_]:
    """Return which quadruples of vectors (q, 4, 3) positively span R^3, (q,)."""
    signed = signed_determinants(vectors)
    spans: NDArray[np.bool_] = (signed.min(axis=-1) > DEPENDENT) | (
        signed.max(axis=-1) < -DEPENDENT
    )
    return spans


def each_cones_positively_span(axes: Array, half_angles: Array) -> NDArray[np.bool_]:
    """Return for many quadruples of circular cones whether they satisfy the generalised P3, (q,).

    Takes `axes` (q, 4, 3); `half_angles` (q, 4) [rad].
    """
    spans = each_positively_spans(axes)
    triples = axes[spans][:, TRIPLES]
    sines = np.sin(half_angles[spans])[:, TRIPLES]
    # the corners of the box (1), whose sides differ: none may reach the unit sphere
    corners = np.linalg.solve(triples, (SIGNS * sines[:, :, None]).swapaxes(-1, -2))
    spans[spans] = np.linalg.norm(corners, axis=-2).max(axis=(1, 2), initial=0.0) < 1.0
    return spans
