"""The verdict on one wrench: predicted, simulated, and whether the two agree."""

from dataclasses import dataclass

from grasp_core.arrays import Array
from grasp_core.by_value import ByValue
from sim_validate.simulation.hold_verdict import LET_GO, HoldVerdict, Outcome
from sim_validate.simulation.traces import Trace
from sim_validate.simulation.wrench_limits import SimulatedLimit

AGREEMENT = 0.02
"""Largest relative error of simulated limits and critical frictions: five times the worst that was
measured."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class WrenchVerdict(ByValue):
    """One wrench on a grasp, predicted and simulated."""

    name: str
    wrench: Array
    """Applied external wrench, (6,) [N, N m], torque about the centre of mass."""
    predicted_limit: float
    """Largest multiple of the applied wrench that the analysis says is resisted."""
    required_friction: float
    """Friction that the planned forces need."""
    hold: HoldVerdict
    simulated_limit: SimulatedLimit | None = None
    """Where the object lets go, relative to the predicted limit; None if not measured, or not
    found."""
    trace: Trace | None = None

    @property
    def contradiction(self) -> str:
        """How simulation contradicts the analysis, in words; empty if it does not."""
        outcome, predicted = self.hold.outcome, self.predicted_limit
        wrong = Outcome.HELD if predicted < 1.0 - AGREEMENT else None
        if (outcome in LET_GO and predicted > 1.0 + AGREEMENT) or outcome is wrong:
            return (f"{self.name}: {outcome.value}, though the predicted limit is "
                    f"{predicted:.4g} times the wrench")  # fmt: skip
        if self.simulated_limit and abs(self.simulated_limit.share - 1.0) > AGREEMENT:
            return f"{self.name}: let go at {self.simulated_limit.share:.4g} of the predicted limit"
        return ""
