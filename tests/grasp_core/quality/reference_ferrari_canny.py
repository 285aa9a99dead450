"""Reference for the compiled polytope: the same method with a hull in NumPy."""

import numpy as np

import grasp_core as gc
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.quality import ferrari_canny as module
from grasp_core.quality.inner_polytope import InnerPolytope
from tests.grasp_core.quality.reference_growing_hull import (
    MOST_POINTS,
    GrowingHull,
    spread_simplex,
)  # fmt: skip


def reference_quality(positions, normals, friction, *, norm="l1", gap=module.GAP):
    """Bounds of the Ferrari-Canny quality about the origin, for a torque scale of one metre."""
    wrenches = WrenchSet.of(
        positions, normals, friction, center=np.zeros(3), torque_scale=1.0, norm=norm
    )
    direction, polytope = _grown(wrenches, gap)
    slack = module.CHECK_SLACK * wrenches.size
    if polytope is None or polytope.radius(wrenches) <= slack:
        return module._outside(wrenches, direction)
    upper = wrenches.support(direction)[0]
    lower = min(polytope.radius(wrenches) - slack, upper)
    return gc.FerrariCanny(lower, upper, wrenches, direction, polytope, None)


def _grown(wrenches, gap):
    """Find the weakest direction, and a polytope that shows there is no much weaker one."""
    edges = wrenches.edges()
    points = edges @ wrenches.G.T
    start = spread_simplex(points)
    if start is None:
        return None, None
    hull, forces = GrowingHull(points[start]), list(edges[start])
    upper, weakest = np.inf, None
    while True:
        normal, offset = hull.lowest()
        support, force = wrenches.support(normal)
        # (1) in the direction of the nearest plane, whose farthest point is the next corner
        if support < upper:
            upper, weakest = support, normal.copy()
        full = len(forces) == MOST_POINTS or hull.size > module.MOST_SIMPLICES
        if upper <= 0.0 or full or upper - offset <= gap * upper:
            break
        if not hull.add(wrenches.G @ force):
            break
        forces.append(force)
    if upper <= 0.0 or hull.lowest()[1] <= 0.0:
        return weakest, None
    normals, corners = hull.simplices()
    return weakest, InnerPolytope(np.array(forces), corners, normals)
