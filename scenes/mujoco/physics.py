"""Lists every MuJoCo setting that scenes are simulated with; scenes spell all of them out.

The defaults were measured to reproduce Coulomb friction to about 0.1 %: elliptic cones (pyramids
are up to 29 % too weak along their diagonals), the `discrete` integrator (under the others, hard
contacts slip when they should hold), a high ratio of friction to normal impedance (resting contacts
otherwise creep), hard and constant contact impedance, and a dense Jacobian (the sparse Newton
solver of MuJoCo 4.0.0 has a bug).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Annotated, Literal

from grasp_core.arrays import Array, Indices
from grasp_core.checked import LARGEST
from grasp_core.errors import InputError
from grasp_core.kinds import NotNegative, Quantity, Range
from grasp_core.settings import Settings
from scenes.mujoco.mjcf_text import COMPILER, Element, add_comment, add_element, element, printable

MOST_ITERATIONS = 10_000
Iterations = Annotated[int, Range(least=1, most=MOST_ITERATIONS)]
Share = Annotated[float, Range(least=0.0, most=1.0)]
Number = Annotated[float, Range(least=-LARGEST, most=LARGEST)]
Component = Annotated[float, Range(least=-1e4, most=1e4)]
Field = tuple[Component, Component, Component]


@dataclass(frozen=True, slots=True, repr=False)
class PhysicsSettings(Settings):
    """Options of the simulation, named as in MJCF.

    Raises:
        InputError: A number is out of its range, or MuJoCo does not know a word.
    """

    timestep: Annotated[float, Range(least=1e-5, most=0.005)] = 0.002
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
    noslip_iterations: Annotated[int, Range(least=0, most=MOST_ITERATIONS)] = 0
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
    solref: tuple[Number, Number] = (0.004, 1.0)
    solimp: tuple[Number, Number, Number, Number, Number] = (0.99, 0.99, 0.001, 0.5, 2.0)
    condim: Literal[1, 3, 4, 6] = 3
    """Contact dimension of MuJoCo; 3 is a hard fingertip, which transmits no torsional friction,
    unless `torsion_m` makes it 4."""
    margin: Share = 0.0
    gap: Share = 0.0
    autoreset: bool = False
    """Whether MuJoCo resets the state when the simulation diverges: the object then silently
    returns to its start, which looks perfectly stable."""
    diagexact: bool = False
    """Whether contact impedances use the exact inertia at each contact."""
    multiccd: bool = True
    """Whether flat shapes touch at several points, which MuJoCo 3.3 does only where asked."""
    torsion_m: Share = 0.0
    """Torsional coefficient of every contact [m]: the largest torque about the normal over the
    normal force, where the contact does not slide; zero is a hard fingertip. Above zero contacts
    have the dimension 4, and this is the second number of their `friction`."""

    def _check_together(self) -> None:
        if 0.0 < self.torsion_m < LEAST_TORSION_M:
            raise InputError(
                f"torsion_m must be 0 or at least {LEAST_TORSION_M:g} m, the smallest friction of "
                f"MuJoCo, got {self.torsion_m}"
            )
        if self.torsion_m and self.condim != WITHOUT_TORSION:
            raise InputError(
                f"torsion_m makes contacts of dimension {WITH_TORSION} by itself: leave condim at "
                f"{WITHOUT_TORSION}, got {self.condim}"
            )

    def options(self) -> dict[str, float | int | str | tuple[float, ...]]:
        """Return the attributes of MJCF's `option` element."""
        elsewhere = (*CONTACT_SETTINGS, *CHOSEN_FLAGS)
        names = (each.name for each in fields(self))
        return {name: getattr(self, name) for name in names if name not in elsewhere}

    def flags(self) -> dict[str, str]:
        """Return all flags of MJCF's `flag` element, so that no default matters."""
        on = {*ENABLED_FLAGS, *(name for name in CHOSEN_FLAGS if getattr(self, name))}
        names = (*ENABLED_FLAGS, *CHOSEN_FLAGS, *UNUSED_FLAGS)
        return {name: "enable" if name in on else "disable" for name in names}

    def contact(self) -> dict[str, float | int | str | tuple[float, ...]]:
        """Return the attributes of each geom that makes contact."""
        condim = WITH_TORSION if self.torsion_m else self.condim
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


def begin_scene(
    name: str, comment: str, physics: PhysicsSettings, radius_m: float,
    mesh: tuple[Array, Indices], *, flags: Mapping[str, str], solids: Sequence[Array] = (),
) -> tuple[Element, Element]:  # fmt: skip
    """Begin a scene: return its root, with all settings and the object's meshes, and its world.

    Takes corners (n, 3) and triangles (t, 3) of the mesh that is shown, and corners (n, 3) of each
    solid that is touched, about the centre of mass [m].
    """
    root = element("mujoco", {"model": printable(name)})
    add_comment(root, comment)
    add_element(root, "compiler", COMPILER)
    option = add_element(root, "option", physics.options())
    add_element(option, "flag", {**physics.flags(), **flags})
    add_element(root, "statistic", {"extent": 3.0 * radius_m, "center": (0.0, 0.0, 0.0)})
    assets = add_element(root, "asset", {})
    seen = {"vertex": mesh[0].ravel(), "face": mesh[1].ravel()}
    add_element(assets, "mesh", {"name": "object", "inertia": "shell"} | seen)
    for place, corners in enumerate(solids):
        solid = {"name": f"surface{place}", "inertia": "shell", "vertex": corners.ravel()}
        add_element(assets, "mesh", solid)
    return root, add_element(root, "worldbody", {})


def add_light(world: Element, radius_m: float) -> None:
    """Add the light above an object."""
    light = {"pos": (0.0, 0.0, 8.0 * radius_m), "dir": (0.0, 0.0, -1.0), "type": "directional"}
    add_element(world, "light", light)


def add_free_body(
    world: Element, mass_kg: float, inertia: Array, center: object = (0.0, 0.0, 0.0),
    more: Mapping[str, object] | None = None,
) -> Element:  # fmt: skip
    """Add the object's body, which moves freely, with its mass and inertia (3, 3) [kg m^2]."""
    place = {"name": "object", "pos": (0.0, 0.0, 0.0), **(more or {})}
    body = add_element(world, "body", place)
    add_element(body, "freejoint", {"name": "object"})
    six = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    add_element(body, "inertial", {"pos": center, "mass": mass_kg, "fullinertia": six})
    return body
