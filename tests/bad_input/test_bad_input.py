"""Every bad file and value of the catalogue ends as the pages promise."""

import dataclasses

import pytest

from tests.bad_input import of_binary_meshes, of_obj
from tests.bad_input.judging import complaints
from tests.bad_input.trying import Trials, Tried
from tests.marks import more

GROUPS = (
    "of_files", "of_obj", "of_binary_meshes", "of_archives", "of_topology", "of_physics",
    "of_data_files", "of_surroundings",
)  # fmt: skip
LEAST = 500
"""Refused cases that there must be."""


@pytest.fixture(scope="module")
def wrong():
    """What is wrong with the answers to some cases, by case."""
    with Trials() as trials:

        def wrong_with(cases):
            tried = {f"{case.group}: {case.name}": (case, trials.tried(case)) for case in cases}
            assert len(tried) == len(cases)  # each has its name
            found = {name: complaints(*both) for name, both in tried.items()}
            return {name: said for name, said in found.items() if said}

        yield wrong_with


def test_some_bad_meshes_are_refused(wrong):
    assert not wrong([*of_obj.cases()[::10], *of_binary_meshes.cases()[::20]])


@pytest.mark.slow
@pytest.mark.parametrize("every", [3, *more(1)])
@pytest.mark.parametrize("group", GROUPS)
def test_bad_input_is_refused(group, every, wrong):
    """Every third case of each group, or all of them."""
    from tests.bad_input import catalogue  # makes whole files, which takes a while

    cases = next(each.cases() for each in catalogue.GROUPS if each.__name__.endswith(group))
    assert not wrong(cases[::every])


@pytest.mark.slow
def test_there_are_hundreds_of_cases_in_eight_groups():
    from tests.bad_input import catalogue

    cases = catalogue.all_cases()
    assert len({case.group for case in cases}) == len(GROUPS)
    assert sum(case.code != 0 for case in cases) >= LEAST
    assert len({(case.group, case.name) for case in cases}) == len(cases)


GOOD = Tried(
    4, "", "graspproof: part.obj: line 2: a coordinate must be finite; repair it\n", 0.1, 100.0, ()
)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({}, None),
        ({"code": 0}, "exit code"),
        ({"code": -9}, "exit code"),
        ({"err": GOOD.err + "Traceback (most recent call last)"}, "traceback"),
        ({"err": "graspproof: it is bad"}, "does not say"),
        ({"err": ""}, "no message"),
        ({"err": GOOD.err * 25}, "screen"),
        ({"err": GOOD.err + "\x1b[2J"}, "control"),
        ({"out": "{}"}, "results"),
        ({"seconds": 11.0}, "took"),
        ({"megabytes": 3000.0}, "took"),
        ({"left": ("grasps.json",)}, "left"),
    ],
)
def test_a_promise_that_is_broken_is_noticed(change, complaint):
    case = next(each for each in of_obj.cases() if each.name == "nan")
    found = complaints(case, dataclasses.replace(GOOD, **change))
    assert found == [] if complaint is None else any(complaint in each for each in found)
