"""Every MuJoCo setting a scene is simulated with; all of them are written into the scene.

The defaults are the ones measured to reproduce Coulomb friction to about 0.1 %: elliptic
cones (pyramids are up to 29 % too weak along their diagonals), the `discrete` integrator
(hard contacts slip falsely under the others at ordinary tolerances), a high ratio of
friction to normal impedance (resting contacts otherwise creep), hard and constant contact
impedance, and a dense Jacobian (the sparse Newton solver of MuJoCo 4.0.0 has a bug).
"""

from dataclasses import asdict, dataclass


@dataclass(frozen=True, slots=True)
class PhysicsSettings:
    """Options of the simulation, named as in MJCF."""

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

    def options(self) -> dict[str, float | int | str | tuple[float, ...]]:
        """What goes into MJCF's `option` element."""
        contact = ("solref", "solimp", "condim", "margin", "gap")
        return {name: value for name, value in asdict(self).items() if name not in contact}

    def contact(self) -> dict[str, float | int | str | tuple[float, ...]]:
        """What goes onto each geom that makes contact."""
        return {
            "condim": self.condim,
            "solref": self.solref,
            "solimp": self.solimp,
            "margin": self.margin,
            "gap": self.gap,
        }


DISABLED_FLAGS = ("autoreset",)
"""After a blow-up MuJoCo would silently return to the start, which looks perfectly stable."""
ENABLED_FLAGS = (
    "constraint", "equality", "frictionloss", "limit", "contact", "spring", "damper", "gravity",
    "clampctrl", "warmstart", "filterparent", "actuation", "refsafe", "sensor", "midphase",
    "nativeccd", "island", "eulerdamp", "multiccd",
)  # fmt: skip
UNUSED_FLAGS = (
    "override", "energy", "fwdinv", "invdiscrete", "sleep", "diagexact", "ipc", "speculative",
)  # fmt: skip
"""Off by default and kept off; a sleeping body would hide drift."""


def flags() -> dict[str, str]:
    """All flags of MJCF's `flag` element, so that no default matters."""
    states = dict[str, str]()
    for name in ENABLED_FLAGS:
        states[name] = "enable"
    for name in (*DISABLED_FLAGS, *UNUSED_FLAGS):
        states[name] = "disable"
    return states
