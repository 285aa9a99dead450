"""What a hand held with its motors in a grasp, and whether that was predicted."""

from dataclasses import field
from typing import Annotated

from pydantic import Field, computed_field

from grasp_core.allowed_values import Friction, Quantity
from grasp_core.by_value import summary
from grasp_core.declared import declared
from grasp_core.errors import InputError
from grasp_core.figures import Shown
from grasp_core.files.records import UNRECORDED
from scenes.mujoco.hand_scenes import HandScene
from sim_validate.closure.verdict import HoldsWrenches, WrenchVerdict
from sim_validate.engine.known_cases import GateCheck
from sim_validate.engine.setup import WEAKEST, Agenda, Setup
from sim_validate.hands.controls import HandControlVerdict


@declared
class HandVerdict(HoldsWrenches):
    """The result of simulating a hand in a grasp: what it held, and whether that was predicted."""

    hand: str
    """Name of the hand."""
    grasp: Annotated[str, Field(alias="id"), Shown("grasp")]
    """Id of the grasp."""
    friction: Friction
    radius_m: Quantity
    """Radius of the object, over which torques count in the size of a wrench."""
    wrenches: tuple[WrenchVerdict, ...]
    controls: tuple[HandControlVerdict, ...]
    setup: Setup
    agenda: Agenda
    checks: Annotated[tuple[GateCheck, ...], UNRECORDED] = field(default=(), compare=False)
    """Cases with known answers on which the simulator was checked first."""
    scene: Annotated[HandScene | None, UNRECORDED] = field(default=None, compare=False)
    """The scene that was simulated; None if the verdict was read from a file."""

    def _check_together(self) -> None:
        if WEAKEST not in {trial.name for trial in self.wrenches}:
            raise InputError(f"wrenches must have one that is named {WEAKEST!r}, got none")

    @computed_field
    @property
    def weakest_n(self) -> Annotated[float, Shown("weakest wrench N", ".3g")]:
        """Size of the weakest wrench that was found, at its predicted limit, torques over radius.

        It is what contacts and motors resist by the analysis.
        """
        return self._largest_n(self.radius_m)

    @computed_field
    @property
    def held(self) -> Annotated[bool, Shown("held")]:
        """Whether every wrench held, at 80 % of what contacts and motors resist by the analysis."""
        return not self.failures

    @computed_field
    @property
    def not_held(self) -> Annotated[tuple[str, ...], Shown("not held")]:
        """Names of the wrenches that were not held."""
        return tuple(trial.name for trial in self.failures)

    controls_let_go = computed_field(HoldsWrenches.controls_let_go)  # type: ignore[override]
    mismatches = computed_field(HoldsWrenches.mismatches)  # type: ignore[override]
    good = computed_field(HoldsWrenches.good)  # type: ignore[override]

    def __repr__(self) -> str:
        told = "held" if self.held else f"{len(self.failures)} of {len(self.wrenches)} not held"
        return summary("HandVerdict", self.hand, self.grasp, told)
