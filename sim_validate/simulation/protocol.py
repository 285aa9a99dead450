"""What is done to a grasp in simulation, and what counts as holding: numbers only.

Wrench hold. The fingers squeeze with planned forces while friction is raised, so that the
transients of loading cannot slip a contact that would hold at rest. Then the wrench and the
forces planned for it are applied together, things settle, friction is lowered to the value
under test, and the object must stay where it is.

Largest wrench. Either holds at several shares of the predicted limit (bisection), or one slow
rise through it (ramp): the object lets go where it has moved by a threshold. The mass must first
be accelerated, so a ramp finds the limit late, never early.

Critical friction. Fingers squeeze the unloaded object with the forces that balance at the
predicted critical friction, friction is lowered to a trial value, and the object must stay;
the trial value is bisected.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import partial
from itertools import pairwise
from typing import Any

from grasp_core.checked import LARGEST, SMALLEST, number, several, whole
from grasp_core.errors import InputError

MOST_ROUNDS = 40
SECONDS, POSITIVE = (0.05, 60.0), (SMALLEST, LARGEST)
RANGES = {
    "hold_s": (0.2, 60.0),  # shorter ones do not see a small imbalance move anything
    "load_share": (0.1, 0.999),  # less would say next to nothing of a grasp
    "control_load": (0.05, 2.0),  # less, and the servos, which hide up to 0.01, might hold it
    "least_normal_share": (1e-4, 0.1),
    "least_excess": (1e-4, 0.01),  # less, and the servos might hold; more, and no control needs it
    "least_friction": (1e-6, 0.01),
    "settling_friction": (1.0, 100.0),
}
"""Where numbers must lie that are neither just durations nor just positive."""


@dataclass(frozen=True, slots=True)
class HoldProtocol:
    """Durations, loads and thresholds of a wrench hold.

    Thresholds are relative to the size of the grasp, the lever of its contacts about the
    axis they are closest to: 2e-4 is 10 um for contacts that span a decimetre. A servo
    hides an unbalanced force of stiffness times displacement, here a thousandth of the
    largest normal force, so looser thresholds would certify the wrong thing.

    Raises:
        InputError: A number is not positive and finite, or out of its range.
    """

    squeeze_s: float = 0.16
    load_s: float = 0.16
    settle_s: float = 0.10
    hold_s: float = 0.40
    settling_friction: float = 3.0
    """Friction while loading, relative to what is tested; for negative controls, to the larger of
    that and what the planned forces need."""
    load_share: float = 0.8
    """Applied wrench relative to the largest one the analysis says is resisted."""
    control_load: float = 0.2
    """Wrench applied to a contact set that resists none, in largest normal forces."""
    least_normal_share: float = 0.005
    """Least planned normal force, in largest normal forces: keeps idle fingers in touch."""
    hold_threshold: float = 2e-4
    """Largest displacement while holding, in grasp sizes."""
    total_threshold: float = 2e-4
    """Largest displacement from the planned pose, in grasp sizes: a tilt acts like as much
    more friction."""
    least_excess: float = 5e-4
    """Contacts whose forces must leave their cones by this share of their sum even without a
    load (minus the closure margin) have to slip without one: less, and the servos, which hide a
    few thousandths of the largest normal force, might hold them."""
    gap_threshold: float = 2e-4
    """A fingertip farther than this from its face has lost contact, in grasp sizes."""

    def __post_init__(self) -> None:
        _check(asdict(self))


@dataclass(frozen=True, slots=True)
class LimitProtocol:
    """How the largest resisted wrench is found, relative to the predicted one.

    Raises:
        InputError: A number is not positive and finite, or out of its range.
    """

    spans: tuple[float, ...] = (0.02, 0.1, 0.5)
    """The limit is sought this far around the predicted one, farther while it is not there."""
    ramp_s: float = 0.5
    """Duration of one rise through the span."""
    ramp_threshold: float = 2e-5
    """Displacement that ends a ramp, in grasp sizes: less than in a hold, as nothing else moves
    the object meanwhile."""
    rounds: int = 4
    """Halvings of the span by bisection."""

    def __post_init__(self) -> None:
        _check(asdict(self))


@dataclass(frozen=True, slots=True)
class FrictionProtocol:
    """How the critical friction is found, relative to the predicted one.

    Raises:
        InputError: A number is not positive and finite, or out of its range.
    """

    spans: tuple[float, ...] = (0.01, 0.1, 0.5)
    """The critical friction is sought this far around the predicted one, farther while it is not
    there."""
    rounds: int = 4
    """Halvings of the span by bisection."""
    settling_friction: float = 5.0
    """Friction while squeezing, relative to the predicted critical friction."""
    least_friction: float = 1e-3
    """Where the prediction is smaller, it is only tried whether this holds."""
    settle_s: float = 0.10
    hold_s: float = 0.40
    threshold: float = 1e-5
    """Largest displacement while holding, in grasp sizes: the servos hide an imbalance of five
    hundred-thousandths of the largest normal force."""

    def __post_init__(self) -> None:
        _check(asdict(self))


def _check(numbers: Mapping[str, Any]) -> None:
    for name, value in numbers.items():
        if name == "spans":
            shares = several(
                value, partial(number, name=name, above=0.0, below=1.0), name, "shares"
            )
            if not (shares and _rising(shares)):
                raise InputError(f"{name} must be rising shares below 1, at least one, got {value}")
        elif name == "rounds":
            whole(value, name, least=1, most=MOST_ROUNDS)
        else:
            least, largest = RANGES.get(name, SECONDS if name.endswith("_s") else POSITIVE)
            number(value, name, least=least, most=largest)


def _rising(values: tuple[float, ...]) -> bool:
    return all(one < two for one, two in pairwise(values))
