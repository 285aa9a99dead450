"""The weakest wrench: a search among all unit wrenches for one that contacts resist least.

A wrench is resisted up to a limiting facet of the body of wrenches that the contacts can apply (see
`wrench_body`), with the twist y and the support h(y). The wrench -y / |y| meets that facet
squarely, so

    limit of -y / |y|  <=  h(y) / |y|:                                                  (1)

stepping from a wrench to the one its limiting facet points at never raises the limit, and stops
at a wrench that is locally the weakest. Torques are compared with forces through a stated length.
"""

from collections.abc import Iterable

import numpy as np

from grasp_core.arrays import Array
from grasp_core.quality.wrench_body import WrenchBody
from grasp_core.quality.wrench_limit import WrenchLimit, limit_of
from grasp_core.solvers.ties import first_best, smallest_first

SETTLED = 1e-3
"""The search for the weakest wrench ends when a step lowers the limit by less than this share."""
MAX_STEPS = 30
STARTS = 3
"""How many of the weakest axis wrenches the search starts from."""


def weakest_from(
    body: WrenchBody, limits: Iterable[WrenchLimit], torque_scale: float
) -> WrenchLimit:
    """Search for a wrench of unit size that is locally the hardest to resist.

    Takes `torque_scale` [m]. Gives the weakest limit found: its wrench has |(force, torque /
    torque_scale)| = 1.
    """
    scale = np.array([1.0] * 3 + [torque_scale] * 3)
    every = list(limits)
    weak = [every[place] for place in smallest_first([found.limit for found in every])]
    ends = [_descend(body, start, scale) for start in weak[:STARTS]]
    return ends[first_best([-found.limit for found in ends])]


def _descend(body: WrenchBody, start: WrenchLimit, scale: Array) -> WrenchLimit:
    best = start
    for _ in range(MAX_STEPS):
        # (1): the wrench that the limiting facet points at, by the scaled product of wrenches
        facing = -best.facet * scale**2
        found = limit_of(body, _unit(facing, scale))
        if found.limit > best.limit * (1.0 - SETTLED):
            break
        best = found
    return best


def _unit(wrench: Array, scale: Array) -> Array:
    return wrench / float(np.linalg.norm(wrench / scale))
