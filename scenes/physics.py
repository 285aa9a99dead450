"""Every MuJoCo setting a scene is simulated with; all of them are written into the scene.

The defaults are the ones measured to reproduce Coulomb friction to about 0.1 %: elliptic
cones (pyramids are up to 29 % too weak along their diagonals), the `discrete` integrator
(hard contacts slip falsely under the others at ordinary tolerances), a high ratio of
friction to normal impedance (resting contacts otherwise creep), hard and constant contact
impedance, and a dense Jacobian (the sparse Newton solver of MuJoCo 4.0.0 has a bug).
"""

from dataclasses import asdict, dataclass

import numpy as np

from grasp_core.checked import positive
from grasp_core.errors import InputError


@dataclass(frozen=True, slots=True)
class PhysicsSettings:
    """Options of the simulation, named as in MJCF.

    Raises:
        InputError: A number is not finite, or one that must be positive is not.
    """

    timestep: float = 0.002
    """[s]"""
    integrator: str = "discrete"
    cone: str = "elliptic"
    solver: str = "Newton"
    jacobian: str = "dense"
    impratio: float = 1000.0
    tolerance: float = 1e-12
    iterations: int = 100
    ls_iterations: int = 50
    ls_tolerance: float = 0.01
    noslip_iterations: int = 0
    noslip_tolerance: float = 1e-6
    ccd_iterations: int = 35
    ccd_tolerance: float = 1e-6
    sdf_iterations: int = 10
    sdf_initpoints: int = 40
    sleep_tolerance: float = 0.001
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """[m/s^2]"""
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    magnetic: tuple[float, float, float] = (0.0, 0.0, 0.0)
    density: float = 0.0
    viscosity: float = 0.0
    solref: tuple[float, float] = (0.004, 1.0)
    solimp: tuple[float, float, float, float, float] = (0.99, 0.99, 0.001, 0.5, 2.0)
    condim: int = 3
    """Three: a hard fingertip transmits no torsion."""
    margin: float = 0.0
    gap: float = 0.0
    autoreset: bool = False
    """After a blow-up MuJoCo would silently return to the start, which looks perfectly stable."""
    diagexact: bool = False
    """Contact impedances from the exact inertia that each contact sees."""

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if not isinstance(value, str) and not np.isfinite(value).all():
                raise InputError(f"{name} must be finite, got {value}")
        for name in ("timestep", "impratio", "iterations"):
            positive(getattr(self, name), name)

    def options(self) -> dict[str, float | int | str | tuple[float, ...]]:
        """What goes into MJCF's `option` element."""
        elsewhere = (*CONTACT_SETTINGS, *CHOSEN_FLAGS)
        return {name: value for name, value in asdict(self).items() if name not in elsewhere}

    def flags(self) -> dict[str, str]:
        """All flags of MJCF's `flag` element, so that no default matters."""
        on = {*ENABLED_FLAGS, *(name for name in CHOSEN_FLAGS if getattr(self, name))}
        names = (*ENABLED_FLAGS, *CHOSEN_FLAGS, *UNUSED_FLAGS)
        return {name: "enable" if name in on else "disable" for name in names}

    def contact(self) -> dict[str, float | int | str | tuple[float, ...]]:
        """What goes onto each geom that makes contact."""
        return {
            "condim": self.condim,
            "solref": self.solref,
            "solimp": self.solimp,
            "margin": self.margin,
            "gap": self.gap,
        }


CONTACT_SETTINGS = ("solref", "solimp", "condim", "margin", "gap")
CHOSEN_FLAGS = ("autoreset", "diagexact")
ENABLED_FLAGS = (
    "constraint", "equality", "frictionloss", "limit", "contact", "spring", "damper", "gravity",
    "clampctrl", "warmstart", "filterparent", "actuation", "refsafe", "sensor", "midphase",
    "nativeccd", "island", "eulerdamp", "multiccd",
)  # fmt: skip
UNUSED_FLAGS = (
    "override", "energy", "fwdinv", "invdiscrete", "sleep", "ipc", "speculative",
)  # fmt: skip
"""Off by default and kept off; a sleeping body would hide drift."""
