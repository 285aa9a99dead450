"""Finds good contacts to begin with: random ones that many twists weigh well, moved uphill.

The quality of contacts is at most what each of many twists allows: their largest support over the
twist's demand. Random contacts are ordered by the least of these bounds, and the first of different
sets of faces climb.
"""

from collections.abc import Sequence

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.geometry.polygons import edge_rows
from grasp_core.objects.face_pieces import FacePiece
from grasp_core.optimizing.ascent import STEP_DIGITS, ContactFaces
from grasp_core.optimizing.best.grounds import Grounds
from grasp_core.optimizing.best.searching.parts import Found
from grasp_core.optimizing.best.searching.search import Searching
from grasp_core.optimizing.best.task_ascent import climbed_for_task, climbs_for_weight
from grasp_core.solvers.ties import on_grid, surpassing
from grasp_core.values import FINGERS

POINTS = 3000
"""Random contacts."""
SETS = 40_000
"""Random sets of four of them."""
CLIMBED = 6
"""Sets of different faces that climb."""
LATER = 500
"""Sets not in force closure that are passed over for others on the same faces: twists of other
measures than the usual one say less of closure."""
AT_ONCE = 4000


def begin(searching: Searching, twists: Array, rng: np.random.Generator) -> Found | None:
    """Return good contacts, or None if no random ones are in force closure.

    Args:
        searching: The search that they are for.
        twists: Twists that bound qualities, (n, 6).
        rng: For the random contacts.
    """
    grounds = searching.grounds
    on = rng.integers(len(grounds.counts), size=POINTS)
    polygons = grounds.polygons()
    at = np.empty((POINTS, 2))
    for place in range(POINTS):
        polygon = polygons[int(on[place])]
        at[place] = on_grid(rng.dirichlet(np.ones(len(polygon))) @ polygon, STEP_DIGITS)
    supports = _supports(grounds, searching.friction, on, at, twists)
    sets = np.sort(rng.integers(POINTS, size=(SETS, FINGERS)), axis=1)
    measure, demands = searching.measure, searching.measure.demands(twists)
    bounds = np.concatenate(
        [
            measure.multiples(supports[sets[k : k + AT_ONCE]].max(axis=1), demands).min(axis=1)
            for k in range(0, SETS, AT_ONCE)
        ]
    )
    tried, closed_later = set[tuple[int, ...]](), 0 if measure.is_usual else LATER
    best: Found | None = None
    for k in np.argsort(-bounds, kind="stable"):
        chosen = sets[k]
        key = tuple(sorted(on[chosen].tolist()))
        if key in tried:
            continue
        tried.add(key)
        found = climbed(searching, on[chosen], at[chosen])
        if found.quality.lower <= 0.0 and closed_later > 0:
            # others on the same faces may be in force closure
            tried.discard(key)
            closed_later -= 1
            continue
        if best is None or found.quality.lower > surpassing(best.quality.lower):
            best = found
        if len(tried) == CLIMBED:
            break
    return best if best is not None and best.quality.lower > 0.0 else None


def climbed(searching: Searching, on: Sequence[int] | Indices, at: Array) -> Found:
    """Move contacts uphill on their pieces."""
    pieces = tuple(piece_at(searching.grounds, int(p)) for p in on)
    limits = tuple(piece.b for piece in pieces)
    faces = ContactFaces(pieces, limits, searching.friction)

    def measured(y: Array) -> Found:
        return searching.measured(np.array(on), y)

    best = measured(at)
    if best.quality.lower <= 0.0:
        return best
    measure = searching.measure
    if measure.name == "weight":
        every = climbs_for_weight(faces, at)
    elif measure.name == "task":
        every = [climbed_for_task(faces, measure, at)]
    else:
        every = [faces.climbed(at)[0]]
    for moved in every:
        there = measured(moved)
        inside = all(
            float((piece.E @ y - piece.b).max()) <= 0.0
            for piece, y in zip(pieces, moved, strict=True)
        )
        if inside and there.quality.lower > best.quality.lower:
            best = there
    return best


def piece_at(grounds: Grounds, place: int) -> FacePiece:
    """Return a polygon as a `FacePiece`."""
    corners = grounds.polygons()[place]
    E, b = edge_rows(corners)
    return FacePiece(
        face=int(grounds.faces[place]), normal=grounds.normals[place],
        origin=grounds.origins[place], frame=grounds.frames[place], corners=corners, E=E, b=b,
        inradius=0.0,
    )  # fmt: skip


def _supports(grounds: Grounds, friction: float, on: Indices, at: Array, twists: Array) -> Array:
    """Return the support of each contact's cone in each twist, (m, n)."""
    points = grounds.origins[on] + np.einsum("kij,kj->ki", grounds.frames[on], at)
    normals = grounds.normals[on]
    u = twists[None, :, :3] + np.cross(twists[None, :, 3:], points[:, None])
    along = np.einsum("mnj,mj->mn", u, normals)
    across = np.linalg.norm(u - along[:, :, None] * normals[:, None], axis=2)
    return along + friction * across
