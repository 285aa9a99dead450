"""Grows polygons as far as a proof allows.

A cover proves more than the discs it was sought for. On a ray of one of its cones the least powers
of the forces sum to s > 0. Each of the m contacts with a force may lose s / m there and no more, so
its place x has to satisfy

    F.(a + b x x) >= its least power - s / m,                                               (1)

a half-plane. The part of a face in all half-planes of its finger is a convex polygon around the old
region. The cover proves these polygons too, as the losses on each ray sum to s at most. The power
that the polygons leave over is shared out again.
"""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.geometry.polygons import ON_LINE, clip, tidy
from grasp_core.regions.largest_discs import Grounds
from grasp_core.regions.proof import TwistCover, power_of, slack_of, summed
from grasp_core.regions.sites import Sites
from grasp_core.solvers.ties import first_best

SHARINGS = 2
"""Number of times that spare power is shared out among the contacts."""
MARGIN = 4.0
"""Power that polygons leave over, as a multiple of the slack with which the proof is checked."""


def shared_out(grounds: Grounds, ys: Array, sites: Sites, cover: TwistCover) -> list[Array]:
    """Grow polygons around sites as far as their proof allows, in the planes, (c, 2) each.

    Takes `ys` (k, 2).
    """
    polygons = list[Array]()
    for _ in range(SHARINGS):
        polygons = _given_away(grounds, ys, sites, cover)
        if min(map(len, polygons)) == 0:
            break  # thinner than the slack of the check
        sites = grounds.around(ys, polygons, np.zeros(len(ys)))
    return polygons


def _given_away(grounds: Grounds, ys: Array, sites: Sites, cover: TwistCover) -> list[Array]:
    """Cut the pieces by all half-planes (1), after sharing out the spare power once."""
    each = range(len(ys))
    rows, limits = [list[Array]() for _ in each], [list[Array]() for _ in each]
    for where, rays in cover.leaves():
        twists, lengths = rays @ cover.axes, summed(rays, cover.axes)
        spare, slopes, lowest = np.zeros(lengths.shape), list[Array](), list[Array]()
        forces = cover.forces[where].swapaxes(0, 1)
        for i, (piece, point, F) in enumerate(
            zip(grounds.pieces, sites.points, forces, strict=True)
        ):
            slope, at_origin = power_of(F, twists)
            slopes.append(slope @ piece.frame)
            lowest.append(sites.lowest(i, slopes[i]))
            spare += at_origin + slope @ point + lowest[i]
            spare -= piece.depth * np.abs(slope @ piece.normal)
            spare -= MARGIN * lengths * slack_of(F, grounds.places(i))[:, None]
        sharing = np.maximum((forces != 0.0).any(axis=2).sum(axis=0), 1)[:, None]
        for i in each:
            sizes = np.linalg.norm(slopes[i], axis=2)
            # (1), per length of its slope
            used = sizes > 0.0
            kept = (lowest[i] - np.maximum(spare, 0.0) / sharing)[used] / sizes[used]
            rows[i].append(-slopes[i][used] / sizes[used][:, None])
            limits[i].append(-kept)
    return [
        y + tidy(_inside(piece.corners - y, np.concatenate(r), np.concatenate(b)))
        for piece, y, r, b in zip(grounds.pieces, ys, rows, limits, strict=True)
    ]


def _inside(polygon: Array, rows: Array, limits: Array) -> Array:
    """Cut a convex polygon (c, 2) by half-planes rows @ y <= limits, few of which matter."""
    while len(rows) and len(polygon):
        beyond = (rows @ polygon.T).max(axis=1) - limits
        worst = first_best(beyond, ON_LINE)
        if beyond[worst] <= 0.0:
            break
        polygon = clip(polygon, rows[worst : worst + 1], limits[worst : worst + 1])
        beyond[worst] = 0.0  # whatever rounding leaves of it: each turn drops this row
        rows, limits = rows[beyond > 0.0], limits[beyond > 0.0]
    return polygon
