"""Applies the acceptance rules of other grasp validators: what would each have accepted?

None of these rules applies a torque: an object is pulled or weighed along the six directions of the
axes, and is accepted if it roughly stays. Here they judge the traces of our own trials, which are
shorter (0.4 s) than theirs (0.5 to 2 s), with forces that are planned, not merely closed.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from grasp_core.errors import InputError
from scenes.layout import Layout
from sim_validate.simulation.hold_verdict import Outcome, judge
from sim_validate.simulation.protocol import HoldProtocol
from sim_validate.simulation.traces import Trace

FORCE_AXES = tuple(f"{sign}force_{axis}" for sign in "+-" for axis in "xyz")
"""Names of the six trials that the rules judge: forces along the axes, without torque."""


@dataclass(frozen=True, slots=True)
class Rule:
    """A named rule by which another validator accepts a grasp."""

    name: str
    source: str
    accepts: Callable[[Trace, Layout, HoldProtocol], bool]
    """Function that decides whether one trial passes; a grasp must pass all six trials."""


def accepted(rule: Rule, trials: Sequence[Trace], layout: Layout, protocol: HoldProtocol) -> bool:
    """Tell whether a rule accepts a grasp: all trials of its six forces must end and pass."""
    return all(not trace.fault and rule.accepts(trace, layout, protocol) for trace in trials)


def _moved_less(shift_m: float, turn_deg: float = np.inf) -> Callable[..., bool]:
    def accepts(trace: Trace, *_: object) -> bool:
        small_turn = trace.rotations_rad[-1] < np.radians(turn_deg)
        return bool(trace.shifts_m[-1] < shift_m and small_turn)

    return accepts


def _touched_at_the_end(trace: Trace, *_: object) -> bool:
    return bool((trace.gaps_m[-1] < 0.0).any())


def _held(trace: Trace, layout: Layout, protocol: HoldProtocol) -> bool:
    return judge(trace, layout, protocol).outcome is Outcome.HELD


RULES = {
    rule.name: rule
    for rule in (
        Rule("5cm-15deg", "DexGraspBench, Dexonomy", _moved_less(0.05, 15.0)),
        Rule("contact-remains", "DexGraspNet, mj-grasp-sim", _touched_at_the_end),
        Rule("2cm", "GenDexGrasp", _moved_less(0.02)),
        Rule("3cm", "GraspQP", _moved_less(0.03)),
        Rule("six-forces", "our thresholds, but no torques and no weakest wrench", _held),
    )
}


def rules_named(names: Sequence[str]) -> tuple[Rule, ...]:
    """Look up acceptance rules of other validators by name."""
    unknown = [name for name in names if name not in RULES]
    if unknown:
        raise InputError(
            f"no acceptance rule is named {unknown[0]!r}; choose from {', '.join(RULES)}"
        )
    return tuple(RULES[name] for name in names)
