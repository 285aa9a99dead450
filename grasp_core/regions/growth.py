"""Grows polygons as far as a proof allows, and then further with new proofs.

A cover proves more than the discs it was sought for. On a ray of one of its cones the least powers
of the forces sum to s > 0. Each of the m contacts with a force may lose s / m there and no more, so
its place x has to satisfy

    F.(a + b x x) >= its least power - s / m,                                               (1)

a half-plane. The part of a face in all half-planes of its finger is a convex polygon around the old
region. The cover proves these polygons too, as the losses on each ray sum to s at most. The power
that the polygons leave over is shared out again.

For larger areas, polygons are moved outwards one finger at a time, and kept if a cover is found.
"""

from collections.abc import Sequence

import numpy as np

from grasp_core.arrays import Array
from grasp_core.geometry.polygons import ON_LINE, SAME_CORNER, clip, edge_rows, signed_area, tidy
from grasp_core.regions.cover_search import search_cover
from grasp_core.regions.largest_discs import Grounds, Proved, part_of_disc
from grasp_core.regions.proof import TwistCover, power_of, slack_of, summed
from grasp_core.regions.sites import Sites
from grasp_core.solvers.ties import first_best, surpassing

SHARINGS = 2
"""Number of times that spare power is shared out among the contacts."""
MARGIN = 4.0
"""Power that polygons leave over, as a multiple of the slack with which the proof is checked."""
FIRST_STEP, LAST_STEP = 0.4, 0.03
"""First and last step by which edges of polygons are moved outwards, relative to the radius of the
discs."""
BEGINNINGS = (1.0, 0.6)
"""Radii of the discs from which large areas grow, relative to the largest proved ones."""
GROWING = 4
"""Factor by which the covers of attempts to grow have fewer cones than are allowed."""


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


def disc_polygons(grounds: Grounds, ys: Array, radius: float) -> list[Array]:
    """Replace discs by polygons, cut to their pieces, in plane coordinates, (c, 2) each."""
    return [
        tidy(part_of_disc(piece, y, radius)) for piece, y in zip(grounds.pieces, ys, strict=True)
    ]


def most_area(
    grounds: Grounds, proved: Proved, beginnings: Sequence[list[Array]]
) -> tuple[list[Array], TwistCover]:
    """Grow polygons of large total area: the best result from discs and other beginnings."""
    axes, discs = grounds.axes(proved.ys), grounds.discs(proved.ys, proved.radius)
    best = shared_out(grounds, proved.ys, discs, proved.cover), proved.cover
    for polygons in beginnings:
        cover = _cover(grounds, proved.ys, polygons, axes)
        if cover is None:
            continue
        polygons, cover = _grown(grounds, proved, polygons, cover, axes)
        sites = grounds.around(proved.ys, polygons, np.zeros(len(polygons)))
        polygons = shared_out(grounds, proved.ys, sites, cover)
        if total_area(polygons) > surpassing(total_area(best[0])):
            best = polygons, cover
    return best


def total_area(polygons: Sequence[Array]) -> float:
    """Add up the areas of counter-clockwise polygons, (c, 2) each."""
    return sum(map(signed_area, polygons))


def _grown(
    grounds: Grounds, proved: Proved, polygons: list[Array], cover: TwistCover, axes: Array
) -> tuple[list[Array], TwistCover]:
    """Move polygons outwards in turn; steps are halved where no proof is found."""
    steps = np.full(len(polygons), FIRST_STEP * proved.radius)
    # each turn halves a step, or moves edges outwards by `LAST_STEP` at least until a piece is full
    while (steps > LAST_STEP * proved.radius).any():
        for i, piece in enumerate(grounds.pieces):
            if steps[i] <= LAST_STEP * proved.radius:
                continue
            tried = list(polygons)
            tried[i] = _offset(piece.corners, polygons[i], steps[i])
            full = signed_area(tried[i]) <= signed_area(polygons[i]) * (1.0 + SAME_CORNER)
            found = None if full else _cover(grounds, proved.ys, tried, axes)
            if found is None:
                steps[i] = 0.0 if full else 0.5 * steps[i]
            else:
                polygons, cover = tried, found
    return polygons, cover


def _cover(grounds: Grounds, ys: Array, polygons: list[Array], axes: Array) -> TwistCover | None:
    sites = grounds.around(ys, polygons, np.zeros(len(ys)))
    return search_cover(sites, axes, grounds.cones // GROWING).cover


def _offset(piece: Array, polygon: Array, distance: float) -> Array:
    """Move the edges of a convex polygon outwards and cut the result to a piece, (c, 2)."""
    E, b = edge_rows(polygon)
    return tidy(clip(piece, E, b + distance))
