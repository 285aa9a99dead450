"""Settings of scenes: physics, fingertips, and what holds an object of true mass.

Each setting is declared once here. Functions take these classes, tables of files and flags of
commands are made of them; see `grasp_core.settings`. Scenes spell out every setting of MuJoCo.
"""

from collections.abc import Mapping
from dataclasses import asdict, fields, replace
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self, TypeAlias

from annotated_types import Interval

from grasp_core.declared import declared, default_of
from grasp_core.errors import InputError
from grasp_core.kinds import LARGEST, Direction, NotNegative, Quantity, Share
from grasp_core.settings import CHOSEN, Settings
from grasp_core.small_objects import fitted

if TYPE_CHECKING:
    from grasp_core.objects.polyhedron import Polyhedron

MOST_ITERATIONS = 10_000
Iterations = Annotated[int, Interval(ge=1, le=MOST_ITERATIONS)]
InBounds = Annotated[float, Interval(ge=-LARGEST, le=LARGEST)]
Component = Annotated[float, Interval(ge=-1e4, le=1e4)]
Field = tuple[Component, Component, Component]


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


HARD_CONTACTS = Softness()


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
    solref: tuple[InBounds, InBounds] = (0.004, 1.0)
    solimp: tuple[InBounds, InBounds, InBounds, InBounds, InBounds] = (0.99, 0.99, 0.001, 0.5, 2.0)
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


GraspFormat: TypeAlias = Literal["gltf"]
EXPORT_ENDINGS: Mapping[GraspFormat, tuple[str, ...]] = {"gltf": (".glb",)}
SurfaceChoice = Literal["object", "pads"]
DriveKind: TypeAlias = Literal["servo", "rigid"]


@declared
class FingertipSettings(Settings):
    """How fingertips are built; a setting that is not given is chosen to suit the grasp."""

    max_normal_force_n: Quantity = 10.0
    """Largest normal force of each finger [N]."""
    fingertip_radius_m: Quantity | None = None
    """Radius of the fingertips in trials of closure [m]; if not given, that of the plan, or a tenth
    of the object's radius, or less where that would overlap something."""
    fingertip_mass_kg: Quantity | None = None
    """Mass of a fingertip [kg]; if not given, it is chosen so that similar grasps behave alike."""
    stiffness_n_per_m: Quantity | None = None
    """Stiffness of the servos that drive a fingertip [N/m]; if not given, it is chosen so that
    similar grasps behave alike."""
    approach: Direction | None = None
    """Direction in which all fingers move towards the object. If not given, each finger takes the
    direction that was planned for it, or its contact normal."""


@declared
class FingerSettings(FingertipSettings):
    """How fingertips are built and driven; a setting that is None is chosen to suit the grasp.

    Raises:
        InputError: A number is out of range (1e-9 to 1e9), or a choice is unknown.
    """

    drive: Annotated[DriveKind, CHOSEN] = "servo"
    """How fingertips are held: pushed by servos, or rigidly fixed in place."""
    indentation: Annotated[float, Interval(ge=0.0, lt=1.0), CHOSEN] = 0.0
    """Depth of each fingertip in its face at the start, in grasp sizes; 0 means just touching."""


@declared
class ScaledScene(Settings):
    """What users choose about a scene with scaled masses, in which closure is tested."""

    fingers: FingertipSettings = FingertipSettings()
    physics: Softness = HARD_CONTACTS
    surface: Annotated[SurfaceChoice | None, CHOSEN] = None
    """What fingertips touch: the object's own surface, or a flat pad at each contact; if not given,
    pads where the faces are patches of a curved surface, else the object."""


SAMPLE_S = 0.005
"""Duration of a sample of an execution: what is applied changes, and motion is recorded, once per
sample [s]."""
UPRIGHT = (0.0, 0.0, -1.0)
WATER_KG_M3 = 1000.0
"""Density of an object of which neither mass nor density is given."""
FITTED: Mapping[str, int] = {
    "off_mm": 1, "max_mm": 1, "tip_stiffness_n_per_m": 1, "push_n": 2, "tip_mass_kg": 2,
}  # fmt: skip
"""Settings that are fitted to small objects, with the power of the size (see `small_objects`)."""


@declared
class HeldSettings(Settings):
    """Masses and damping of what holds and is held, and the direction of gravity.

    Raises:
        InputError: A number is out of its range, or a mass and a density are given.
    """

    mass_kg: Quantity | None = None
    """Mass of the object [kg]."""
    density_kg_m3: Quantity | None = None
    """Density of the object, in place of its mass; that of water, 1000, if neither is given
    [kg/m^3]."""
    tip_mass_kg: Quantity = 0.05
    """Mass of a fingertip with the part of its finger that moves with it [kg]."""
    damping_ratio: Annotated[float, Interval(ge=0.01, le=10.0)] = 0.5
    """Damping ratio of the object between the springs; with 0.5 it overshoots once, by a sixth."""
    down: Direction = UPRIGHT
    """Direction of gravity in the object's frame, in trials that do not choose their own; its
    length does not matter."""
    keep_defaults: bool = False
    """Keep the defaults for objects of every size. Otherwise numbers that are left at them are
    fitted to objects with a radius below 25 mm: with s the radius over 25 mm, `off_mm`, `max_mm`
    and `tip_stiffness_n_per_m` are multiplied by s, `push_n` and `tip_mass_kg` by its square. Files
    say which numbers were used."""

    def _check_together(self) -> None:
        if self.mass_kg is not None and self.density_kg_m3 is not None:
            raise InputError("mass_kg and density_kg_m3 exclude each other: leave one of them out")

    @property
    def weighed(self) -> bool:
        """Return whether a mass or a density is given."""
        return self.mass_kg is not None or self.density_kg_m3 is not None

    @property
    def object_kg(self) -> float:
        """Mass of the object [kg], where it is given or `for_body` has set it."""
        if self.mass_kg is None:
            raise InputError("the mass of the object is not known: give mass_kg")
        return self.mass_kg

    def mass_of(self, body: "Polyhedron") -> float:
        """Return the mass of an object, as given or by its density [kg]."""
        if self.mass_kg is not None:
            return self.mass_kg
        return body.mass_at(WATER_KG_M3 if self.density_kg_m3 is None else self.density_kg_m3)

    def for_body(self, body: "Polyhedron") -> Self:
        """Return the settings with the mass of an object, and with what is fitted to its size."""
        usual = {each.name: default_of(each) for each in fields(self) if each.name in FITTED}
        small = {
            name: fitted(number, body.radius, FITTED[name])
            for name, number in usual.items()
            if not self.keep_defaults and getattr(self, name) == number
        }
        return replace(self, mass_kg=self.mass_of(body), density_kg_m3=None, **small)
