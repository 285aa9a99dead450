"""Says which loads contacts are to resist, and how much of them each twist asks for.

A measure of contacts is the largest multiple of a convex set D of loads, which holds zero, that
they resist with normal forces of sum one newton: the largest m with -m w in W for all w of D, where
W is the set of their wrenches (`l1`, see `wrench_sets`). A convex set holds another if its support
is nowhere smaller, so that m D is resisted if and only if for every twist y

    h(y) >= m d(y),    d(y) = max over w in D of -y.w,                                      (1)

with the support h of W. This *demand* d of a twist is

    ferrari-canny   |y|                      D: wrenches of length one (torques over a length)
    weight          |v|, y = (v, omega)      D: forces of one newton at the centre of mass
    task            max(0, max_j -y.w_j)     D: the hull of zero and the loads w_j

So the measure is the least h(y) / d(y) over twists with d(y) > 0, provided that h is nowhere
negative. Twists are taken as unit ones, with torques over the object's radius; the demand of
ferrari-canny is then one.
"""

from dataclasses import dataclass, field
from typing import Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from grasp_core.arrays import Array, frozen, frozen_copy, is_a, is_array
from grasp_core.by_value import ByValue
from grasp_core.checked import LARGEST, SMALLEST, one_of
from grasp_core.closure.wrenches import WRENCH
from grasp_core.errors import InputError

MeasureName: TypeAlias = Literal["ferrari-canny", "weight", "task"]
"""Which loads count: wrenches of unit length, the weight in every orientation, or a user's loads.
"""
MOST_LOADS = 100
"""Most loads of a task: each takes a cone program wherever contacts are measured, and a search
measures thousands of contacts."""
SMALL_DEMAND = 1e-2
"""Demand of a unit twist below which a twist with negative support is compared as if it had this
one: it refutes every multiple, and none better than others do."""


def _no_loads() -> Array:
    return frozen_copy(np.zeros((0, WRENCH)))


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Measure(ByValue):
    """The set of loads whose largest resisted multiple is a measure of contacts."""

    name: MeasureName
    loads: Array = field(default_factory=_no_loads)
    """External wrenches of a task, with torques about the centre of mass over the object's radius,
    (m, 6) [N]; none for other measures."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "loads", frozen(self.loads, (None, WRENCH), "loads"))

    @classmethod
    def of(cls, name: str, wrenches: ArrayLike | None, radius: float) -> "Measure":
        """Make a measure from a user's words and wrenches.

        Takes `wrenches` (force, torque) or (m, 6) [N, N m]; `radius` [m]. Gives the measure, with
        torques over the radius.
        """
        one_of(name, get_args(MeasureName), "measure")
        if name != "task":
            if wrenches is not None:
                raise InputError(
                    f"wrenches: expected none with measure {name!r}; leave them out, or take "
                    "measure 'task'"
                )
            return cls("weight" if name == "weight" else "ferrari-canny")
        if wrenches is None:
            raise InputError(
                "wrenches: expected those of the task with measure 'task', got None; give an "
                "array of shape (m, 6), forces in N and torques in N m"
            )
        loads = frozen(wrenches, (None, WRENCH), "wrenches") / np.repeat([1.0, radius], 3)
        if not 0 < len(loads) <= MOST_LOADS:
            raise InputError(
                f"wrenches: expected 1 to {MOST_LOADS} wrenches, got {len(loads)}; leave out those "
                "that are mixtures of others"
            )
        sizes = np.linalg.norm(loads, axis=1)
        wrong = np.flatnonzero((sizes < SMALLEST) | (sizes > LARGEST))
        if wrong.size:
            raise InputError(
                f"wrenches: row {int(wrong[0])} must be from {SMALLEST:g} to {LARGEST:g} N long, "
                f"torques over the object's radius, got {float(sizes[wrong[0]]):.6g}; leave out "
                "wrenches that ask for nothing, and give others in N and N m"
            )
        return cls("task", loads)

    def sound(self) -> bool:
        """Return whether this is a measure, of any origin."""
        known = is_a(self.name, str) and self.name in get_args(MeasureName)
        if not (known and is_array(self.loads, None, WRENCH)):
            return False
        if self.name != "task":
            return len(self.loads) == 0
        sizes = np.linalg.norm(self.loads, axis=1)
        return 0 < len(sizes) <= MOST_LOADS and bool(
            sizes.min() >= SMALLEST and sizes.max() <= LARGEST
        )

    @property
    def is_usual(self) -> bool:
        """Return whether this is the Ferrari-Canny quality."""
        return is_a(self.name, str) and self.name == "ferrari-canny"

    @property
    def size(self) -> float:
        """Return the length of the longest load, torques over the object's radius [N]."""
        return float(np.linalg.norm(self.loads, axis=1).max()) if self.name == "task" else 1.0

    def demands(self, twists: Array) -> Array:
        """Compute the demands (1) of twists at unit length, (n, 6): how much they ask for, (n,)."""
        if self.name == "weight":
            return np.asarray(np.linalg.norm(twists[:, :3], axis=1), dtype=np.float64)
        if self.name == "task":
            return np.maximum(-(twists @ self.loads.T).min(axis=1), 0.0)
        return np.ones(len(twists))

    def multiples(self, supports: Array, demands: Array) -> Array:
        """Compute the multiples of the loads that twists allow, of the supports' shape (..., n).

        Twists with negative support allow none; theirs are negative.
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            allowed = np.where(demands > 0.0, supports / demands, np.inf)
        return np.where(supports < 0.0, supports / np.maximum(demands, SMALL_DEMAND), allowed)

    def keeps(self, maps: Array, slack: float) -> NDArray[np.bool_]:
        """Return which orthogonal matrices (g, 3, 3) map the loads to themselves, (g,)."""
        if self.name != "task":
            return np.ones(len(maps), dtype=np.bool_)
        # a reflection turns torques the other way round
        signs = np.sign(np.linalg.det(maps))[:, None, None]
        forces, torques = self.loads[:, :3], self.loads[:, 3:]
        turned = (forces @ maps.transpose(0, 2, 1), signs * (torques @ maps.transpose(0, 2, 1)))
        images = np.concatenate(turned, axis=2)
        apart = np.linalg.norm(images[:, :, None] - self.loads, axis=3).min(axis=2)
        return np.asarray(apart.max(axis=1) <= slack * self.size, dtype=np.bool_)


FERRARI_CANNY = Measure("ferrari-canny")
