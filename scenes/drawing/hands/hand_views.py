"""Chooses the view that shows an object and the hand that holds it best.

A hand is several times as large as what it holds, and most views show its back only. So the view
also may be from below, and the contacts and the object should be seen past palm and fingers.
"""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.solvers.ties import first_best
from scenes.drawing.hands.posed_hands import (
    HandParts,
    PosedHand,
    numbers_behind,
    parts_of,
)
from scenes.drawing.views import (
    DISTANCE,
    SAME_MERIT,
    Alone,
    View,
    edge_on,
    least_gaps,
    views_at,
)

ELEVATIONS = (18, 28, 40, 0, -18, -28, -40)
"""Elevations of the views to choose from [deg]; of equally good ones the first is taken."""
HIDDEN = 4.0
"""Fault of a view in which the hand hides all contacts."""
BEHIND = 1.0
"""Fault of a view in which the hand hides all of the object's faces that it could show."""
ALONG = 0.8
"""Fault of a view along the way from the middle of the hand to the object: fingers look short."""
EDGE_ON = 0.5
"""Fault of a view in which all of the object's faces are seen nearly as lines."""
TINY = 1e-12
"""Least length of a ray along an axis, so that it may be divided by [m]."""
INSIDE = 0.9
"""Share of a part's size within which it hides what is behind it: a fingertip's rim hides no
contact."""


def extent_with(body: Polyhedron, parts: HandParts) -> Alone:
    """Measure a ball around an object and a hand."""
    reaches = np.linalg.norm(parts.half_sizes, axis=1) + parts.radii
    middles = np.vstack([parts.middles, body.vertices])
    sizes = np.concatenate([reaches, np.zeros(len(body.vertices))])
    low, high = (middles.T - sizes).min(axis=1), (middles.T + sizes).max(axis=1)
    center = 0.5 * (low + high)
    return Alone(center, float((np.linalg.norm(middles - center, axis=1) + sizes).max()))


def view_of_hand(body: Polyhedron, held: PosedHand) -> View:
    """Choose a view in which contacts, object and hand are seen."""
    parts = parts_of(held)
    extent = extent_with(body, parts)
    angles, axes = views_at(ELEVATIONS)
    cameras = extent.center_of_mass + DISTANCE * extent.radius * axes[:, 2]
    centroids = np.array([face.centroid for face in body.faces])
    arms = cameras[:, None] - centroids
    facing = np.einsum("vfi,fi->vf", arms, body.normals) < 0.0  # normals point into the object
    behind = _hidden(centroids, cameras, parts) & facing
    covered = behind.sum(axis=1) / np.maximum(facing.sum(axis=1), 1)
    hidden = _hidden(held.positions, cameras, parts).mean(axis=1)
    apart = least_gaps(axes, np.vstack([held.positions, numbers_behind(held)]), extent)
    merits = apart / body.radius - HIDDEN * hidden - BEHIND * covered
    way = body.center_of_mass - parts.middles.mean(axis=0)
    along = np.abs(axes[:, 2] @ way) / max(float(np.linalg.norm(way)), TINY)
    merits -= EDGE_ON * edge_on(body, axes) + ALONG * along
    return View.of_angles(*angles[first_best(merits, SAME_MERIT)], extent)


def _hidden(points: Array, cameras: Array, parts: HandParts) -> Array:
    """Tell which points (p, 3) the parts of a hand hide from cameras (v, 3), (v, p).

    A ray is inside a box where it is between the two planes of each pair: from the last entry to
    the first exit. For a rounded box the box in it is taken, which a contact on it is outside of.
    """
    sizes = INSIDE * (parts.half_sizes + parts.radii[:, None] / np.sqrt(3.0))
    hides = np.zeros((len(cameras), len(points)), dtype=bool)
    for middle, turned, half in zip(parts.middles, parts.axes, sizes, strict=True):
        starts = (points - middle) @ turned
        ways = (cameras - middle) @ turned
        ways = ways[:, None] - starts
        ways = np.where(np.abs(ways) < TINY, TINY, ways)
        one, two = (-half - starts) / ways, (half - starts) / ways
        enters, leaves = np.minimum(one, two).max(axis=2), np.maximum(one, two).min(axis=2)
        hides |= leaves > np.maximum(enters, 0.0)
    return hides
