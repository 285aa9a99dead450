"""Other processors' arithmetic gives the same plans, regions, better and best grasps, verdicts."""

import json

import pytest

import grasp_core as gc
import scenes
from tests.benchmarks.machines import (
    answers,
    arithmetics,
    asked,
    differences,
    improved,
    regions,
)
from tests.marks import more

OBJECTS = ["octahedron", "wedge"]


@pytest.fixture(scope="module")
def own():
    """The answers of this machine."""
    return asked({}, OBJECTS)


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", ["least of all", *more("OpenBLAS for Haswell")])
def test_plans_regions_and_verdicts_are_those_of_this_machine(name, own):
    other = asked(arithmetics()[name], OBJECTS)
    assert len(own) == len(other) == 12 * len(OBJECTS)
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


MOVED = {"figures": lambda figure: figure * (1.0 + 2e-6), "frictions": lambda mu: mu + 2e-7}
"""By kind, a change of a number that is a little more than is allowed."""


def test_other_regions_and_improvements_are_noticed():
    """Another proof, a corner less, a radius or a corner off by a little more than is allowed."""
    body = scenes.example_object("tetrahedron")
    grasp = gc.plan(body, 0.5, limit=1).grasps[0]
    for own in (regions(body, grasp, 0.5), improved(body, grasp, 0.5)):
        assert own["exact"][-1] is True
        assert differences("case", own, json.loads(json.dumps(own))) == []
        others = {
            "exact": [*own["exact"][:-1], False],
            "places": [own["places"][0] + 2e-7, *own["places"][1:]],
            **{
                kind: [moved(own[kind][0]), *own[kind][1:]]
                for kind, moved in MOVED.items()
                if own.get(kind)
            },
        }
        assert len(others) == 3
        for field, value in others.items():
            assert len(differences("case", own, {**own, field: value})) == 1
        assert len(differences("case", own, {**own, "places": own["places"][:-3]})) == 1
