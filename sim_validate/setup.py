"""How trials are simulated, and which trials a grasp goes through: the choices of a user."""

import math
from dataclasses import dataclass, field
from typing import Literal

from grasp_core.arrays import Array
from grasp_core.errors import InputError
from scenes.fingertips import FingerSettings
from scenes.mjcf import Surface
from scenes.physics import PhysicsSettings
from sim_validate.protocol import FrictionProtocol, HoldProtocol, LimitProtocol

AXIS_NAMES = tuple(
    f"{sign}{kind}_{axis}" for sign in "+-" for kind in ("force", "torque") for axis in "xyz"
)
WEAKEST = "weakest"
RANDOM = "random_{}"


@dataclass(frozen=True, slots=True)
class Setup:
    """How trials are simulated."""

    fingers: FingerSettings = field(default_factory=FingerSettings)
    physics: PhysicsSettings = field(default_factory=PhysicsSettings)
    surface: Surface = "pads"
    """What fingertips touch: pads, exact on any object, or the mesh of a convex one."""
    hold: HoldProtocol = field(default_factory=HoldProtocol)
    limit: LimitProtocol = field(default_factory=LimitProtocol)
    friction: FrictionProtocol = field(default_factory=FrictionProtocol)
    threads: int = 1
    """Of the simulator; results do not depend on it."""
    timeout_s: float = math.inf
    """Trials of one contact set that run longer are stopped."""


@dataclass(frozen=True, slots=True, eq=False)
class NamedWrench:
    """An external wrench from a user."""

    name: str
    wrench: Array
    """(6,) [N, N m], torque about the centre of mass, in the object's frame."""


@dataclass(frozen=True, slots=True)
class Agenda:
    """Which trials a grasp goes through.

    The twelve axis wrenches and the weakest one are always held, at a share of what the analysis
    says is resisted; so are random ones. A user's wrenches are held as they are.
    """

    random_wrenches: int = 0
    wrenches: tuple[NamedWrench, ...] = ()
    critical_friction: bool = True
    """Find the critical friction in simulation."""
    limits: Literal["none", "ramp", "bisection"] = "none"
    """Find the largest multiple of each wrench in simulation."""
    independent: bool = False
    """Also try what does not know the planned forces (`independent`)."""
    controls: bool = True
    rules: tuple[str, ...] = ()
    """Acceptance rules of other tools by which the same traces are also judged."""
    keep_traces: bool = False
    seed: int = 0
    """Chooses random wrenches, and how contacts are moved for a negative control."""

    def __post_init__(self) -> None:
        """Refuse names that two trials would share: records go by name."""
        drawn = (RANDOM.format(place) for place in range(self.random_wrenches))
        taken = {*AXIS_NAMES, WEAKEST, *drawn}
        for each in self.wrenches:
            if each.name in taken:
                raise InputError(f"two wrenches are named {each.name!r}: rename yours")
            taken.add(each.name)
