"""Every bad file and value of the catalogue ends as the pages promise."""

import pytest

from tests.bad_input.cases import GROUPS, cases_of, tried

EVERYDAY = {"of_obj", "of_topology"}
APART = {
    "inspect: a file that is an endless device", "a name with an escape", "glb: 10^5 deep nodes",
    "a line of two megabytes", "NUMBA_NUM_THREADS=0",
}  # fmt: skip
"""Cases that are also tried in processes of their own, as users run the command."""


@pytest.mark.parametrize("group", [pytest.param(group, marks=[pytest.mark.slow] * (
    group not in EVERYDAY)) for group in GROUPS])  # fmt: skip
def test_bad_input_is_refused(group):
    found = {case.name: tried(case)[2] for case in cases_of(group)}
    assert {name: wrong for name, wrong in found.items() if wrong} == {}


@pytest.mark.slow
def test_commands_in_processes_of_their_own_refuse_alike():
    named = [case for group in GROUPS for case in cases_of(group) if case.name in APART]
    assert len(named) == len(APART)
    for case in named:
        assert tried(case, apart=True) == tried(case)
