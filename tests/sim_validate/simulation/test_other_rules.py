import numpy as np
import pytest

import grasp_core as gc
import scenes
from sim_validate.simulation.other_rules import FORCE_AXES, RULES, accepted, rules_named
from sim_validate.simulation.protocol import HoldProtocol
from sim_validate.simulation.traces import Trace
from tests.sim_validate.rigs import grasps


@pytest.fixture(scope="module")
def layout():
    body, (grasp, *_) = grasps("wedge", 0.5, 1)
    return scenes.build_scene(body, grasp, 0.5).layout


def ending(shift_m=0.0, turn_deg=0.0, touching=4):
    """A trace of two samples that ends like this."""
    ends = np.array([0.0, 1.0])
    gaps = np.full((2, 4), -1e-9)
    gaps[1, touching:] = 1e-3
    return Trace(
        times_s=0.01 * (1 + ends), displacements_m=shift_m * ends, shifts_m=shift_m * ends,
        rotations_rad=np.radians(turn_deg) * ends, slips_m=np.zeros((2, 4)), gaps_m=gaps,
        touched_m=np.zeros((2, 4, 3)), start_m=0.0, finite=True, warnings=0, clock_error_s=0.0,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("end", "by"),
    [
        ({}, {"5cm-15deg", "contact-remains", "2cm", "3cm", "six-forces"}),
        ({"shift_m": 0.019, "turn_deg": 14.0}, {"5cm-15deg", "contact-remains", "2cm", "3cm"}),
        ({"shift_m": 0.019, "turn_deg": 16.0}, {"contact-remains", "2cm", "3cm"}),
        ({"shift_m": 0.025}, {"5cm-15deg", "contact-remains", "3cm"}),
        ({"shift_m": 0.049, "touching": 0}, {"5cm-15deg"}),
        ({"shift_m": 0.06, "touching": 1}, {"contact-remains"}),
        ({"shift_m": 1.0, "touching": 0}, set()),
    ],
)
def test_each_rule_accepts_what_its_tool_would(layout, end, by):
    trials = [ending()] * 5 + [ending(**end)]
    say = {name for name, rule in RULES.items() if accepted(rule, trials, layout, HoldProtocol())}
    assert say == by


def test_our_own_rule_has_the_thresholds_of_the_setup(layout):
    trials, rule = [ending(shift_m=1e-3 * layout.grasp_size_m)] * 6, RULES["six-forces"]
    loose = HoldProtocol(hold_threshold=1e-2, total_threshold=1e-2)
    assert not accepted(rule, trials, layout, HoldProtocol())
    assert accepted(rule, trials, layout, loose)


def test_the_forces_are_six_and_have_no_torque():
    assert len(FORCE_AXES) == 6
    assert all("force" in name for name in FORCE_AXES)


def test_an_unknown_rule_is_refused_by_name():
    with pytest.raises(gc.InputError, match="rule is named '1cm'; choose from 5cm-15deg"):
        rules_named(["2cm", "1cm"])
