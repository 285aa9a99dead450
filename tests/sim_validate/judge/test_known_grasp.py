"""The simulator is checked on a recorded grasp with known answers, and refused if it is wrong."""

from dataclasses import replace

import pytest

from grasp_core.errors import UnfaithfulError
from sim_validate.engine.kept_gates import checked
from sim_validate.judge.known_grasp import KnownGrasp
from sim_validate.protocols.settings import JudgeSettings


@pytest.mark.parametrize("push_n", [1.0, 20.0], ids=["settings limit", "motors limit"])
@pytest.mark.parametrize("friction", [0.2, 0.8])
@pytest.mark.parametrize("coupled", [False, True], ids=["hinges", "hinges that follow"])
def test_what_is_resisted_is_known_in_closed_form(push_n, friction, coupled):
    setup = JudgeSettings(friction=friction, push_n=push_n).setup
    checks = KnownGrasp.of(setup, friction, coupled=coupled).checks()
    assert len(checks) == 6
    assert all(each.passed for each in checks), [str(each) for each in checks]


def test_a_simulator_that_does_not_solve_for_contact_forces_is_refused():
    setup = JudgeSettings().setup
    hasty = replace(setup, physics=replace(setup.physics, iterations=1))
    with pytest.raises(UnfaithfulError, match="the same in simulation"):
        checked(KnownGrasp.of(hasty, 0.51))
