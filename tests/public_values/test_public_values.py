"""Whatever is handed to a public function or constructor, the answer is clear."""

import enum
import inspect
import re
from dataclasses import is_dataclass

import pytest

import grasp_core as gc
import scenes
import sim_validate as sv
from grasp_core.by_value import MOST_TEXT
from tests.public_values import calls_of_execution, calls_of_grasp_core, calls_of_simulation

PACKAGES = {"gc": gc, "scenes": scenes, "sv": sv}
CALLS = [*calls_of_grasp_core.CALLS, *calls_of_execution.CALLS, *calls_of_simulation.CALLS]
BY_NAME = {call.name: call for call in CALLS}
MADE_BY_FUNCTIONS = {
    "gc": "BestGrasp BestSqueeze CarriedContact CarriedGrasp CertifiedRegions ClosureCertificate "
    "FaceChange FerrariCanny FirstSlip FrictionInterval GraspFigures Grip Hand "
    "HandPayload HandReach Improvement Payload PlacementProbability Plan QualityCeiling Transfer "
    "WrenchLimit",
    "scenes": "HandScene HeldScene Layout Scene Sheet Turntable",
    "sv": "ExecutedGrasp Execution ExecutionTrial Executions HandVerdict Judgement "
    "Judgements PublishedProtocol RecordJudgement Verdict Verdicts",
}
"""Results, by package: users read them and do not make them."""
NAMED_OTHERWISE = {
    ("gc.Polyhedron.from_mesh", "vertices"): "vert|object",
    ("gc.Polyhedron.from_mesh", "triangles"): "triangle",
    ("gc.placement_probability", "pose_covariance"): "covariance",
    ("gc.plan", "settings"): "settings|theta_deg|_m must",
    ("gc.iter_grasps", "settings"): "settings|theta_deg|_m must",
    ("scenes.example_object", "name"): "name|object",
    ("scenes.write_picture", "path"): "path|picture's name",
}
"""What messages say of arguments in place of their names."""
LONGEST_MESSAGE = 400


def public_callables():
    """Functions and classes by the name that users write, without errors and enumerations."""
    for short, package in PACKAGES.items():
        for name in package.__all__:
            thing = getattr(package, name)
            if not (inspect.isclass(thing) and issubclass(thing, Exception | enum.Enum)):
                yield f"{short}.{name}"


def test_every_public_function_and_class_is_in_the_table():
    makers = {"gc.Polyhedron.from_mesh", "gc.Motors.in_any_orientation"}
    results = {f"{short}.{name}" for short, names in MADE_BY_FUNCTIONS.items()
               for name in names.split()}  # fmt: skip
    assert set(public_callables()) | makers == BY_NAME.keys() | results


@pytest.mark.parametrize(
    "call",
    [
        pytest.param(call, marks=pytest.mark.slow if call.slow else (), id=call.name)
        for call in CALLS
        if not call.succeeds_in
    ],
)
def test_the_call_that_is_spoiled_succeeds_as_it_is(call):
    found = call.target(**call.valid())
    assert found is not None
    if is_dataclass(found):
        assert len(repr(found)) <= MOST_TEXT
        assert "\n" not in repr(found)


def complaint(call, argument, value):
    """What is wrong with how a bad value is refused; nothing if it is named in a line."""
    try:
        call.target(**{**call.valid(), argument: value})
    except gc.InputError as refusal:
        said = str(refusal)
    except Exception as error:
        return repr(error)
    else:
        return "is taken"
    words = NAMED_OTHERWISE.get((call.name, argument), argument)
    named = re.search(words, said) or ("no/such" in str(value) and str(value) in said)
    return "" if named and len(said) < LONGEST_MESSAGE and "\n" not in said else said


@pytest.mark.parametrize("name", BY_NAME)
def test_bad_values_of_every_argument_are_refused_and_named(name):
    call = BY_NAME[name]
    given = inspect.signature(call.target).parameters.values()
    named = {each.name for each in given if each.kind is not inspect.Parameter.VAR_KEYWORD}
    assert named == set(call.refused)
    assert all(len(values) > 1 for values in call.refused.values())
    wrong = {
        f"{argument}: {label}": complaint(call, argument, value)
        for argument, values in call.refused.items()
        for label, value in values.items()
    }
    assert {case: said for case, said in wrong.items() if said} == {}
