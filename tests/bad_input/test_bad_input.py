"""Every bad file and value of the catalogue ends as the pages promise."""

import pytest

from tests.bad_input.cases import GROUPS, cases_of
from tests.bad_input.trying import complaints, tried

APART = {
    "of_files": ("inspect: a file that is an endless device", "a name with an escape"),
    "of_binary_meshes": ("glb: 10^5 deep nodes",),
    "of_obj": ("a line of fifty megabytes",),
}
"""Cases that are also tried in processes of their own, as users run the command."""


@pytest.mark.parametrize("group", [pytest.param(group, marks=[pytest.mark.slow] * (
    group not in {"of_obj", "of_topology"})) for group in GROUPS])  # fmt: skip
def test_bad_input_is_refused(group):
    found = {case.name: complaints(case, tried(case)) for case in cases_of(group)}
    assert {name: wrong for name, wrong in found.items() if wrong} == {}


@pytest.mark.slow
@pytest.mark.parametrize("group", APART)
def test_commands_in_processes_of_their_own_refuse_alike(group):
    for case in (case for case in cases_of(group) if case.name in APART[group]):
        here, apart = (tried(case, apart=apart) for apart in (False, True))
        assert complaints(case, apart) == []
        assert (apart.code, apart.message) == (here.code, here.message)
