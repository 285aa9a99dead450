"""Whatever is handed to a public function or constructor, the answer is clear."""

import enum
import inspect
import re
from dataclasses import is_dataclass

import pytest

import grasp_core as gc
import scenes
import sim_validate as sv
from grasp_core.by_value import MOST
from tests.public_values import (
    calls_of_analysis,
    calls_of_execution,
    calls_of_hands,
    calls_of_protocols,
    calls_of_simulation,
    calls_of_values,
)

PACKAGES = {"gc": gc, "scenes": scenes, "sv": sv}
CALLS = [
    *calls_of_analysis.CALLS, *calls_of_execution.CALLS, *calls_of_hands.CALLS,
    *calls_of_values.CALLS,
    *calls_of_simulation.CALLS, *calls_of_protocols.CALLS,
]  # fmt: skip
BY_NAME = {call.name: call for call in CALLS}
MADE_BY_FUNCTIONS = {
    "sv.ExecutedGrasp": "load_executions",
    "sv.Executions": "load_executions",
    "sv.SavedCarriedGrasp": "load_transfer",
    "sv.SavedTransfer": "load_transfer",
    "sv.SavedVerdict": "load_verdicts",
    "sv.SavedVerdicts": "load_verdicts",
    "gc.BestGrasp": "best_grasp",
    "scenes.Sheet": "grasp_figure",
    "gc.BestSqueeze": "best_squeeze",
    "gc.FirstSlip": "first_slip",
    "gc.FreeMass": "payload",
    "gc.Grip": "grip",
    "gc.Hand": "load_hand",
    "gc.HandPayload": "hand_payload",
    "gc.HandReach": "reach_with",
    "gc.Payload": "payload",
    "gc.CertifiedRegions": "certify_regions and load_regions",
    "gc.CarriedContact": "transfer",
    "gc.CarriedGrasp": "transfer",
    "gc.FaceChange": "transfer",
    "gc.GraspFigures": "transfer",
    "gc.Transfer": "transfer",
    "gc.ClosureCertificate": "force_closure",
    "gc.FerrariCanny": "ferrari_canny",
    "gc.FrictionInterval": "critical_friction_interval",
    "gc.Improvement": "optimize_contacts",
    "gc.Plan": "plan",
    "gc.QualityCeiling": "quality_ceiling",
    "gc.WrenchLimit": "wrench_limits",
    "scenes.HandScene": "build_hand_scene",
    "scenes.HeldScene": "build_held_scene",
    "scenes.Layout": "build_scene",
    "scenes.Scene": "build_scene",
    "scenes.Turntable": "show",
    "sv.Judgement": "judge_by and judge_hand_by",
    "sv.PublishedProtocol": "protocol",
    "sv.Execution": "execute",
    "sv.ExecutionTrial": "execute",
    "sv.HandVerdict": "validate_hand",
    "sv.Verdict": "validate",
}
"""Results: users read them and do not make them."""
REFUSED = [
    (name, argument, label)
    for name, call in BY_NAME.items()
    for argument, values in call.refused.items()
    for label in values
]
NAMED_OTHERWISE = {
    ("gc.Polyhedron.from_mesh", "vertices"): "vert|object",
    ("gc.Polyhedron.from_mesh", "triangles"): "triangle",
    ("scenes.example_object", "name"): "name|object",
    ("scenes.write_picture", "path"): "path|picture's name",
    ("sv.load_regions", "path"): "path|no/such",
    ("sv.load_executions", "path"): "path|no/such",
    ("sv.load_verdicts", "path"): "path|no/such",
    ("sv.load_transfer", "path"): "path|no/such",
    ("gc.load_grasps", "path"): "path|no/such",
    ("sv.load_dataset", "folder"): "folder|no/such",
    ("sv.load_dex_record", "path"): "path|no/such",
    ("sv.write_report", "folder"): "folder|no/such",
}
"""What messages say of arguments in place of their names."""
FEWEST_CASES = 3000
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
    assert set(public_callables()) | makers == {*BY_NAME, *MADE_BY_FUNCTIONS}


@pytest.mark.parametrize("name", BY_NAME)
def test_every_argument_has_values_that_are_refused(name):
    call = BY_NAME[name]
    assert set(inspect.signature(call.target).parameters) == set(call.refused)
    assert all(len(values) > 1 for values in call.refused.values())


def test_there_are_many_cases():
    assert len(REFUSED) > FEWEST_CASES


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(call.name, marks=pytest.mark.slow if call.slow else ())
        for call in CALLS
        if not call.succeeds_in
    ],
)
def test_the_call_that_is_spoiled_succeeds_as_it_is(name):
    call = BY_NAME[name]
    found = call.target(**call.valid())
    assert found is not None
    if is_dataclass(found):
        assert len(repr(found)) <= MOST
        assert "\n" not in repr(found)


@pytest.mark.parametrize(("name", "argument", "label"), REFUSED)
def test_a_bad_value_is_refused_and_named(name, argument, label):
    call = BY_NAME[name]
    given = {**call.valid(), argument: call.refused[argument][label]}
    with pytest.raises(gc.InputError) as refusal:
        call.target(**given)
    said = str(refusal.value)
    assert re.search(NAMED_OTHERWISE.get((name, argument), argument), said), said
    assert len(said) < LONGEST_MESSAGE
    assert "\n" not in said
