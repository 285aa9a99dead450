"""Settings of scenes: fingertips, and what holds an object of true mass.

Each setting is declared once, here or in `mujoco_options`. Functions take these classes, tables of
files and flags of commands are made of them; see `grasp_core.settings`.
"""

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Annotated, Literal, Self, TypeAlias

from annotated_types import Interval

from grasp_core.allowed_values import Direction, Quantity
from grasp_core.declared import declared, default_of
from grasp_core.errors import InputError
from grasp_core.settings import CHOSEN, Settings
from grasp_core.small_objects import fitted
from scenes.mujoco_options import HARD_TIPS, Softness

if TYPE_CHECKING:
    from grasp_core.objects.polyhedron import Polyhedron

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
    physics: Softness = HARD_TIPS
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
