"""The verdict on a hand in a grasp: what it held with its motors, and its negative controls."""

from dataclasses import dataclass

import numpy as np

from grasp_core.by_value import ByValue, summary
from scenes.hands.hand_mjcf import HandScene
from sim_validate.hands.hand_controls import HandControl
from sim_validate.simulation.gate.case import Check
from sim_validate.simulation.hold_verdict import LET_GO, HoldVerdict, Outcome
from sim_validate.simulation.setup import WEAKEST, Agenda, Setup
from sim_validate.validation.wrench_verdict import WrenchVerdict


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class HandControlVerdict(ByValue):
    """How a negative control of a hand ended in simulation."""

    control: HandControl
    hold: HoldVerdict

    @property
    def let_go(self) -> bool:
        """Return whether the object moved, as it must."""
        return self.hold.outcome in LET_GO


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class HandVerdict(ByValue):
    """The result of simulating a hand in a grasp: what it held, and whether that was predicted."""

    hand: str
    """Name of the hand."""
    grasp: str
    """Id of the grasp."""
    friction: float
    wrenches: tuple[WrenchVerdict, ...]
    controls: tuple[HandControlVerdict, ...]
    checks: tuple[Check, ...]
    """Cases with known answers on which the simulator was checked first."""
    scene: HandScene
    setup: Setup
    agenda: Agenda

    @property
    def failures(self) -> tuple[WrenchVerdict, ...]:
        """Return the wrenches that were not held, in order."""
        return tuple(trial for trial in self.wrenches if trial.hold.outcome is not Outcome.HELD)

    @property
    def held(self) -> bool:
        """Return whether every wrench held."""
        return not self.failures

    @property
    def weakest_n(self) -> float:
        """Return the size of the weakest wrench that was found, at its predicted limit [N].

        Torques count over the object's radius.
        """
        trial = next(each for each in self.wrenches if each.name == WEAKEST)
        scale = np.array([1.0] * 3 + [self.scene.layout.radius_m] * 3)
        return trial.predicted_limit * float(np.linalg.norm(trial.wrench / scale))

    @property
    def controls_let_go(self) -> bool:
        """Return whether every negative control let go of the object, as it must."""
        return all(control.let_go for control in self.controls)

    @property
    def mismatches(self) -> tuple[str, ...]:
        """Return where simulation contradicts the analysis, one sentence each."""
        found = [trial.contradiction for trial in self.wrenches if trial.contradiction]
        if self.agenda.limits != "none":
            found += [f"{trial.name}: the limit was not found near the predicted one"
                      for trial in self.wrenches if trial.simulated_limit is None]  # fmt: skip
        return tuple(found)

    @property
    def good(self) -> bool:
        """Return whether wrenches held, controls let go, and nothing was contradicted."""
        return self.held and self.controls_let_go and not self.mismatches

    def __repr__(self) -> str:
        told = "held" if self.held else f"{len(self.failures)} of {len(self.wrenches)} not held"
        return summary("HandVerdict", self.hand, self.grasp, told)
