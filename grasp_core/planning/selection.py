"""Selects which of the grasps found are returned, and puts them in order."""

from collections.abc import Callable, Iterable, Sequence
from itertools import chain, zip_longest

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.critical_friction import critical_friction
from grasp_core.errors import NoForcesError
from grasp_core.execution.best_squeeze import GAP, searched
from grasp_core.execution.grips import STIFFNESS_N_PER_M, Grip, springs
from grasp_core.execution.loads import any_direction
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.certify import Certified, LateFigures
from grasp_core.planning.reach import Finger
from grasp_core.planning.request import FAMILIES, PlanRequest
from grasp_core.solvers.ties import SAME_SHARE, first_best, ranks
from grasp_core.values import Grasp

PUSH_N = 10.0
"""Largest push of a finger under which payloads and first slips are compared [N]."""
TIP_RADIUS = 0.1
"""Radius of fingertips whose size is not given, in object radii: that of scenes."""


def chosen(
    body: Polyhedron, lists: Sequence[Sequence[Certified]], request: PlanRequest
) -> list[Certified]:
    """Select the grasps to return, the best first.

    By radius, families take turns: the best of each, then the second of each, and so on. By another
    measure all grasps compete. `diverse` begins with the largest discs and goes on with the grasp
    that is farthest from all before it.
    """
    every = _largest_first(chain.from_iterable(lists))
    if request.rank_by == "radius":
        families = [[one for one in every if one.family == family] for family in FAMILIES]
        turns = [one for one in chain.from_iterable(zip_longest(*families)) if one is not None]
        return _largest_first(turns[: request.limit])
    if request.rank_by == "diverse":
        return _far_apart(every, request.limit)
    measure, same = _measure(body, request)
    return _in_order(every, [measure(found) for found in every], same)[: request.limit]


def _measure(body: Polyhedron, request: PlanRequest) -> tuple[Callable[[Certified], float], float]:
    """Return what makes grasps better the smaller it is, and the share of it that is none."""
    if request.rank_by == "friction-margin":
        return lambda found: critical_friction(found.placement.positions, found.normals), SAME_SHARE
    if request.rank_by == "ferrari-canny":

        def quality(found: Certified) -> float:
            positions, normals = found.placement.positions, found.normals
            return -LateFigures(positions, normals, request.friction).ferrari_canny()[0]

        return quality, SAME_SHARE

    def lightness(found: Certified) -> float:
        points = body.radius * found.placement.positions
        return -_carried(body, points, found.normals, request.friction, request.finger)

    # the best squeeze is searched to a gap, so equal grasps may come out as far apart
    return lightness, 2.0 * GAP


def _carried(
    body: Polyhedron, points: Array, normals: Array, friction: float, finger: Finger | None
) -> float:
    """Return the mass that the best squeeze of contacts survives in any orientation [kg].

    It is certified, in the linear model; zero where no squeeze holds. Takes contact points about
    the centre of mass.
    """
    count, tip = len(points), TIP_RADIUS * body.radius if finger is None else finger.radius_m
    start = Grip(
        points, normals, np.full(count, friction), np.zeros((count, 3)),
        springs(STIFFNESS_N_PER_M, count), np.full(count, tip),
    )  # fmt: skip
    try:
        return searched(start, any_direction(1.0), PUSH_N).scale
    except NoForcesError:
        return 0.0


def carried(body: Polyhedron, grasp: Grasp, friction: float, finger: Finger | None) -> float:
    """Return the mass in any orientation that ranks a grasp [kg]; 0 if none is held."""
    points = grasp.positions - body.center_of_mass
    return _carried(body, points, grasp.normals, friction, finger)


def _largest_first(found: Iterable[Certified]) -> list[Certified]:
    """Order grasps by their smallest discs, the largest first; those without discs come last."""
    listed = list(found)
    # the merit of a grasp with discs is that radius, as reproducible as a program's optimum
    return _in_order(
        listed, [-one.placement.merit if one.placement.radii.min() > 0.0 else 0.0 for one in listed]
    )


def _in_order(
    found: Sequence[Certified], figures: Sequence[float], same: float = SAME_SHARE
) -> list[Certified]:
    """Order grasps by a figure, the smallest first; equal ones stay in the order given."""
    return [found[place] for place in np.argsort(ranks(figures, same), kind="stable")]


def _far_apart(every: Sequence[Certified], limit: int | None) -> list[Certified]:
    """Order grasps so that each next one is as far as possible from the nearest before it.

    The distance of two grasps is the largest distance of a contact of one from the nearest contact
    of the other, relative to the object's radius.
    """
    if not every:
        return []
    places = np.array([found.placement.positions for found in every])
    nearest = np.full(len(every), np.inf)
    kept = [0]
    while len(kept) < min(len(every), limit or len(every)):
        gaps = np.linalg.norm(places[:, :, None] - places[kept[-1]][None, None], axis=-1)
        there = np.maximum(gaps.min(axis=1).max(axis=1), gaps.min(axis=2).max(axis=1))
        nearest = np.minimum(nearest, there)
        nearest[kept] = -np.inf
        kept.append(first_best(nearest))
    return [every[place] for place in kept]
