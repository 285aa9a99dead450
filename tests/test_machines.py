"""Other processors' arithmetic gives the same plans and verdicts."""

import pytest

from tests.benchmarks.machines import answers, arithmetics, asked, differences

OBJECTS = ["octahedron", "wedge"]


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", ["least of all", "OpenBLAS for Haswell"])
def test_plans_and_verdicts_are_those_of_this_machine(name):
    own, other = asked({}, OBJECTS), asked(arithmetics()[name], OBJECTS)
    assert len(own) == len(other) == 9 * len(OBJECTS)
    assert sum(len(grasps) for grasps in own.values() if isinstance(grasps, list)) > 500
    assert [line for case in own for line in differences(case, own[case], other[case])] == []


def test_differences_are_noticed():
    """A grasp less, one moved by a billionth of the object, one of another friction."""
    case = "tetrahedron at 0.5000"
    own = answers(["tetrahedron"])[case]
    assert differences(case, own, own) == []
    assert differences(case, own, own[1:])
    first = own[0]
    others = {
        "contacts": [x + 2e-9 for x in first["contacts"]],
        "friction": first["friction"] + 2e-7,
        "faces": [3, 2, 1, 0],
    }
    for field, value in others.items():
        assert differences(case, own, [{**first, field: value}, *own[1:]])
