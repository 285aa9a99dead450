"""Makes proved regions larger: polygons grow as far as a proof allows, and centres move.

A cover proves more than the discs it was sought for. On a ray of one of its cones the least powers
of the forces sum to s > 0. Each of the m contacts with a force may lose s / m there and no more, so
its place x has to satisfy

    F.(a + b x x) >= its least power - s / m,                                               (1)

a half-plane. The part of a face in all half-planes of its finger is a convex polygon around the old
region. The cover proves these polygons too, as the losses on each ray sum to s at most. The power
that the polygons leave over is shared out again.

Centres. A cover has fixed contact forces for each cone. The power of a fixed force is linear in the
position of its contact. So the largest radius r that these forces allow, over all centres c_i with
the discs on their faces, is one linear program:

    maximise r  over c_i, r
    sum over i of F_i.(a + b x c_i) - r |T_i'(F_i x b)| >= 0   for each ray of each cone,   (2)
    E_i c_i + r <= b_i                                          for each face.              (3)

New centres allow other forces, so new covers are sought around them, again and again while the
radius grows. The paper's own program for concurrent grasps is of this kind, with one focus for all
twists.
"""

from dataclasses import replace

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import SolverError
from grasp_core.geometry.polygons import ON_LINE, clip, nearest_point, tidy
from grasp_core.regions.largest_discs import Grounds, Proved, Sites, largest_discs
from grasp_core.regions.proof import TwistCover, power_of, slack_of, summed
from grasp_core.solvers.lp import LinearProgram, Optimum, maximize
from grasp_core.solvers.ties import first_best, nearest_optimum, on_grid

SHARINGS = 2
"""Number of times that spare power is shared out among the contacts."""
MARGIN = 4.0
"""Power that polygons leave over, as a multiple of the slack with which the proof is checked."""
MOVES = 12  # of all centres, at most
MOVING = 8
"""Factor by which covers have fewer cones while centres move than are allowed in the end."""
WORTH = 1.005
"""Least growth of the radius, as a factor, at which centres are moved once more."""
FARTHEST = 1.0
"""Largest distance that a centre moves at once, in radii."""
MOVED_DIGITS = 6
"""Digits after the point that moved centres keep."""
STOPPING = 3.0
"""Rays count in the program if they would stop a radius up to this factor of the present one."""


def shared_out(grounds: Grounds, ys: Array, sites: Sites, cover: TwistCover) -> list[Array]:
    """Grow polygons around sites as far as their proof allows, in the planes, (c, 2) each."""
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


def better_centers(grounds: Grounds, ys: Array) -> Array:
    """Find centres with larger discs, or return the same where no radius is proved around them."""
    coarse = replace(grounds, cones=grounds.cones // MOVING)
    best = largest_discs(coarse, ys)
    if best is None:
        return ys
    for _ in range(MOVES):
        moved = _best_for_forces(coarse, best)
        found = None if moved is None else largest_discs(coarse, moved, best.radius)
        if found is None or inside_faces(coarse, found) < WORTH * inside_faces(coarse, best):
            break
        best = found
    return best.ys


def larger_inside(grounds: Grounds, one: Proved | None, other: Proved | None) -> Proved | None:
    """Return whichever of two sets of discs has the larger discs inside the faces."""
    if one is None or other is None:
        return other if one is None else one
    return (one, other)[first_best([inside_faces(grounds, each) for each in (one, other)])]


def inside_faces(grounds: Grounds, proved: Proved) -> float:
    """Return the largest radius of discs that are proved and lie inside the faces."""
    depths = [(p.b - p.E @ y).min() for p, y in zip(grounds.pieces, proved.ys, strict=True)]
    return min(proved.radius, *map(float, depths))


def _best_for_forces(grounds: Grounds, proved: Proved) -> Array | None:
    """Find the best centres near the present ones for a cover's forces, or None."""
    k = len(proved.ys)
    rows, limits = list[Array](), list[Array]()
    points = grounds.points(proved.ys)
    for where, rays in proved.cover.leaves():
        twists = rays @ proved.cover.axes
        twists = (twists / np.linalg.norm(twists, axis=2, keepdims=True)).reshape(-1, 6)
        powers, falls, moves = np.zeros(len(twists)), np.zeros(len(twists)), list[Array]()
        forces = proved.cover.forces[where]
        sizes = np.sqrt(np.einsum("mki,mki->m", forces, forces))[:, None]
        for piece, point, F in zip(grounds.pieces, points, forces.swapaxes(0, 1), strict=True):
            each = np.repeat(F / sizes, rays.shape[1], axis=0)
            slope, at_origin = power_of(each, twists[:, None])
            slope, across = slope[:, 0], slope[:, 0] @ piece.frame
            powers += at_origin[:, 0] + slope @ point - piece.depth * np.abs(slope @ piece.normal)
            falls += np.linalg.norm(across, axis=1)
            moves.append(across)
        # (2), for moves from the present centres
        near = powers < STOPPING * proved.radius * falls
        rows.append(np.column_stack([-np.hstack(moves), falls])[near])
        limits.append(powers[near])
    # (3), for the same moves
    for i, (piece, y) in enumerate(zip(grounds.pieces, proved.ys, strict=True)):
        edges = np.zeros((len(piece.E), 2 * k + 1))
        edges[:, 2 * i : 2 * i + 2], edges[:, -1] = piece.E, 1.0
        rows.append(edges)
        limits.append(piece.b - piece.E @ y)
    box = np.eye(2 * k, 2 * k + 1)
    rows += [box, -box]
    limits += [np.full(2 * k, FARTHEST * proved.radius)] * 2
    c = np.zeros(2 * k + 1)
    c[-1] = 1.0
    program = LinearProgram(c, np.vstack(rows), np.concatenate(limits))
    try:
        best = maximize(program)
    except SolverError:
        return None
    if not isinstance(best, Optimum):
        return None
    moved = on_grid(proved.ys + nearest_optimum(program, best)[:-1].reshape(k, 2), MOVED_DIGITS)
    return np.array([
        nearest_point(piece.corners, y) for piece, y in zip(grounds.pieces, moved, strict=True)
    ])  # fmt: skip
