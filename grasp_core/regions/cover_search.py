"""Searches for covers of all twists, the proofs of independent regions, in compiled code.

A cover is a list of cones that fill the space of twists, each with contact forces that together
have power on all its rays. Cones are divided until such forces are found for each; `regions.proof`
derives why that is enough, and checks the answer. `regions.sites` describes how forces are found.
The search also stops when it finds a twist that contacts at some places do not resist.
"""

from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import compiled
from grasp_core.regions.proof import LEAF, TWIST, TwistCover
from grasp_core.regions.sites import Sites

KERNEL = "grasp_core.regions.cover_kernel"


@dataclass(frozen=True, slots=True, eq=False)
class Searched:
    """How a search ended: with a proof, with contacts not in force closure, or with neither."""

    cover: TwistCover | None = None
    choice: Array | None = None
    """Contacts that leave a twist unresisted, except for rounding, (k, 3)."""


def search_cover(sites: Sites, axes: Array, cones: int) -> Searched:
    """Search for a cover that proves force closure for all contacts in given sites.

    Takes `axes` (6, 6).
    """
    # the search sees sites on a grid, so that it ends alike on all machines
    kernel, told = compiled(KERNEL), sites.on_grid()
    k, most = len(sites.points), max(cones, 1 << TWIST)
    tree = kernel.Tree(np.zeros(most, np.int64), np.zeros((most, k, 3)), np.zeros((k, 3)))
    ended, count = kernel.search(told, axes, (most, told.clear()), tree)
    # (5), translated from shifts along the frames to places
    if ended == kernel.REFUTED:
        return Searched(choice=sites.points + np.einsum("kij,kj->ki", sites.frames, tree.shifts))
    if ended != kernel.COVERED:
        return Searched()
    codes = tree.codes[:count]
    return Searched(_cover(sites, axes, codes, tree.forces[:count][codes == LEAF]))


def _cover(sites: Sites, axes: Array, codes: Indices, forces: Array) -> TwistCover:
    return TwistCover(axes, codes, np.einsum("kij,mkj->mki", sites.frames, forces))
