"""Settings with which recorded grasps are judged; nothing here is slow to import."""

from typing import TYPE_CHECKING, Annotated

from annotated_types import Interval

from grasp_core.allowed_values import Friction, Quantity
from grasp_core.declared import declared
from grasp_core.messages import FieldError
from grasp_core.settings import Settings
from scenes.settings import FingerSettings
from sim_validate.settings import HoldProtocol, ProtocolName

if TYPE_CHECKING:
    from sim_validate.engine.setup import Setup

HELD_SIZES = 1e-3
"""Displacement from which a hand has let go in our trial, in grasp sizes: the twentieth of a
millimetre for contacts that span a decimetre. Loads are a fifth below what is resisted, and servos
hide two per cent of the largest push in such a displacement."""


@declared
class ChosenJudging(Settings):
    """How recorded grasps are judged, beside published tests."""

    friction: Friction = 0.5
    """Coulomb coefficient of the proof and of our trial; published tests have their own."""
    touch_m: Annotated[float, Interval(ge=0.0, le=0.01)] = 0.002
    """Largest gap of a link that counts as touching [m]; 2 mm are those of DexGraspBench."""
    push_n: Quantity = 5.0
    """Largest normal force of a contact in the analysis and in our trial [N], and of the squeeze of
    records that state none."""
    mass_kg: Quantity = 0.1
    """Mass of the object whose weight our trial applies [kg]; 0.1 kg is that of DexGraspBench."""
    trial: bool = True
    """Also have the hand close on the object in our own trial, hold loads, and let controls go."""


@declared
class JudgeSettings(ChosenJudging):
    """How recorded grasps are judged.

    Raises:
        InputError: A number is out of its range, no published test has a name, or one is named
            twice.
    """

    tests: tuple[ProtocolName, ...] = ("dexgraspbench",)
    """Names of published tests."""

    def _check_together(self) -> None:
        if len({*self.tests}) < len(self.tests):
            raise FieldError("tests", f"must be different, got {', '.join(self.tests)}")

    @property
    def setup(self) -> "Setup":
        """Return how our trial is simulated."""
        from scenes.mujoco.hand_scenes import hand_physics  # slow, as the next, and no flag needs
        from sim_validate.engine.setup import Setup

        return Setup(
            fingers=FingerSettings(max_normal_force_n=self.push_n), physics=hand_physics(),
            hold=HoldProtocol(hold_threshold=HELD_SIZES),
        )  # fmt: skip
