"""MuJoCo's options: every setting of the simulator that scenes spell out, and how contacts yield.

No default of MuJoCo's matters, since defaults change between releases.
"""

from dataclasses import asdict, fields
from typing import Annotated, Any, Literal

from annotated_types import Interval

from grasp_core.allowed_values import LARGEST, NotNegative, Quantity, Share
from grasp_core.declared import declared
from grasp_core.errors import InputError
from grasp_core.settings import Settings

MOST_ITERATIONS = 10_000
Iterations = Annotated[int, Interval(ge=1, le=MOST_ITERATIONS)]
Coef = Annotated[float, Interval(ge=-LARGEST, le=LARGEST)]
Component = Annotated[float, Interval(ge=-1e4, le=1e4)]
Field = tuple[Component, Component, Component]
WITHOUT_TORSION, WITH_TORSION = 3, 4
LEAST_TORSION_M = 1e-5
"""Smallest torsional coefficient above zero: MuJoCo raises smaller ones to this value."""
CONTACT_SETTINGS = ("solref", "solimp", "condim", "margin", "gap", "torsion_m")
CHOSEN_FLAGS = ("autoreset", "diagexact", "multiccd")
ENABLED_FLAGS = (
    "constraint", "equality", "frictionloss", "limit", "contact", "spring", "damper", "gravity",
    "clampctrl", "warmstart", "filterparent", "actuation", "refsafe", "sensor", "nativeccd",
    "eulerdamp",
)  # fmt: skip
UNUSED_FLAGS = (
    "override", "energy", "fwdinv", "invdiscrete", "sleep", "ipc", "speculative", "midphase",
    "island",
)  # fmt: skip
"""Flags that are off. MuJoCo leaves most of them off; a body put to sleep would hide drift. The
last two are on elsewhere: they save time in large scenes, cost a seventh of it in small ones, and
change no bit of a motion."""


@declared
class Softness(Settings):
    """How soft the fingertips are in simulation."""

    torsion_m: Share = 0.0
    """Torsional coefficient of the fingertips [m]: the largest torque about the normal of a contact
    over its normal force, where it does not slide. Zero is a hard fingertip; a soft one has a
    fraction of the size of the area that it touches."""

    @property
    def is_soft(self) -> bool:
        """Return whether contacts resist torques about their normals."""
        return self.torsion_m > 0.0

    def rubbing(self, friction: float) -> tuple[float, float, float]:
        """Return the coefficients of a contact as in MJCF: sliding, torsional and rolling."""
        return friction, self.torsion_m, 0.0


HARD_TIPS = Softness()


@declared
class PhysicsSettings(Softness):
    """Options of the simulation, named as in MJCF, and the torsion of its contacts.

    The defaults were measured to reproduce Coulomb friction to about 0.1 %: elliptic cones
    (pyramids are up to 29 % too weak along their diagonals), the `discrete` integrator (under the
    others, hard contacts slip when they should hold), a high ratio of friction to normal impedance
    (resting contacts otherwise creep), hard and constant contact impedance, and a dense Jacobian.
    Under MuJoCo 4.0.0, whose sparse Newton solver gives wrong accelerations, scenes with the solver
    `Newton` and a sparse Jacobian, which `auto` is from 60 degrees of freedom on, are refused.

    Raises:
        InputError: A number is out of its range, or MuJoCo does not know a word.
    """

    timestep: Annotated[float, Interval(ge=1e-5, le=0.005)] = 0.002
    """Length of a step, from 1e-5 to 0.005 [s]. With steps twice as long, objects let go at
    frictions 40 % above the critical friction, and few of the cases with known answers reveal it.
    """
    integrator: Literal["Euler", "RK4", "implicit", "implicitfast", "discrete"] = "discrete"
    cone: Literal["pyramidal", "elliptic"] = "elliptic"
    solver: Literal["PGS", "CG", "Newton"] = "Newton"
    jacobian: Literal["dense", "sparse", "auto"] = "dense"
    impratio: Quantity = 1000.0
    tolerance: Share = 1e-16
    """Tolerance of MuJoCo's solver, an absolute one on squared accelerations. An object a
    thousandth as large has squared accelerations a millionth as large: with 1e-12, contacts of
    millimetre-sized objects slip when they should hold."""
    iterations: Iterations = 100
    ls_iterations: Iterations = 50
    ls_tolerance: Share = 0.01
    noslip_iterations: Annotated[int, Interval(ge=0, le=MOST_ITERATIONS)] = 0
    noslip_tolerance: Share = 1e-6
    ccd_iterations: Iterations = 35
    ccd_tolerance: Share = 1e-6
    sdf_iterations: Iterations = 10
    sdf_initpoints: Iterations = 40
    sleep_tolerance: Share = 0.001
    gravity: Field = (0.0, 0.0, 0.0)
    """Acceleration of gravity in the world frame [m/s^2]."""
    wind: Field = (0.0, 0.0, 0.0)
    magnetic: Field = (0.0, 0.0, 0.0)
    density: NotNegative = 0.0
    viscosity: NotNegative = 0.0
    solref: tuple[Coef, Coef] = (0.004, 1.0)
    solimp: tuple[Coef, Coef, Coef, Coef, Coef] = (0.99, 0.99, 0.001, 0.5, 2.0)
    condim: Literal[1, 3, 4, 6] = 3
    """Contact dimension of MuJoCo; 3 is a hard fingertip, which transmits no torsional friction. A
    `torsion_m` above zero makes it 4."""
    margin: Share = 0.0
    gap: Share = 0.0
    autoreset: bool = False
    """Whether MuJoCo resets the state when the simulation diverges: the object then silently
    returns to its start, which looks perfectly stable."""
    diagexact: bool = False
    """Whether contact impedances use the exact inertia at each contact."""
    multiccd: bool = True
    """Whether flat shapes touch at several points, which MuJoCo 3.3 does only where asked."""

    def _check_together(self) -> None:
        if 0.0 < self.torsion_m < LEAST_TORSION_M:
            raise InputError(
                f"torsion_m must be 0 or at least {LEAST_TORSION_M:g} m, the smallest friction of "
                f"MuJoCo, got {self.torsion_m}"
            )
        if self.is_soft and self.condim != WITHOUT_TORSION:
            raise InputError(
                f"torsion_m makes contacts of dimension {WITH_TORSION} by itself: leave condim at "
                f"{WITHOUT_TORSION}, got {self.condim}"
            )

    def record(self) -> dict[str, Any]:
        """Return the settings by name; two of them only where unusual, as older files have it."""
        usual = {"torsion_m": 0.0, "multiccd": True}
        return {name: value for name, value in asdict(self).items() if value != usual.get(name)}

    def options(self) -> dict[str, float | int | str | tuple[float, ...]]:
        """Return the attributes of MJCF's `option` element."""
        elsewhere = (*CONTACT_SETTINGS, *CHOSEN_FLAGS)
        names = (each.name for each in fields(self))
        return {name: getattr(self, name) for name in names if name not in elsewhere}

    def require_hard(self, where: str, why: str) -> None:
        """Refuse soft fingertips where nothing is predicted for them."""
        if self.is_soft:
            raise InputError(f"physics.torsion_m must be zero {where}, got {self.torsion_m}: {why}")

    def flags(self) -> dict[str, str]:
        """Return all flags of MJCF's `flag` element, so that no default matters."""
        on = {*ENABLED_FLAGS, *(name for name in CHOSEN_FLAGS if getattr(self, name))}
        names = (*ENABLED_FLAGS, *CHOSEN_FLAGS, *UNUSED_FLAGS)
        return {name: "enable" if name in on else "disable" for name in names}

    def contact(self) -> dict[str, float | int | str | tuple[float, ...]]:
        """Return the attributes of each geom that makes contact."""
        condim = WITH_TORSION if self.is_soft else self.condim
        return {"condim": condim, "solref": self.solref, "solimp": self.solimp,
                "margin": self.margin, "gap": self.gap}  # fmt: skip
