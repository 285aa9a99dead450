import copy
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace

import numpy as np
import pytest

import grasp_core as gc
import scenes
import sim_validate as sv
from grasp_core.by_value import MOST_TEXT, ByValue
from scenes.example_objects import example_object

FRICTION = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Value(ByValue):
    name: str = "a"
    numbers: np.ndarray = field(default_factory=lambda: np.arange(3.0))
    parts: tuple = ()
    table: Mapping = field(default_factory=dict)
    size: float = 1.0
    seconds: float = field(default=0.0, compare=False)


@pytest.fixture(scope="module")
def body():
    return scenes.example_object("tetrahedron")


@pytest.fixture(scope="module")
def plan(body):
    return gc.plan(body, FRICTION, limit=3)


@pytest.fixture(scope="module")
def results(body, plan):
    grasp = plan[0]
    squeeze = gc.best_squeeze(body, grasp, FRICTION, gc.any_direction(0.5, 5.0))
    payload = gc.payload(
        body, grasp, FRICTION, max_push_n=10.0, stiffness=2000.0, tip_radius_m=0.01
    )
    return [
        body, plan, grasp, squeeze, payload, gc.first_slip(squeeze.grip, squeeze.load),
        gc.force_closure(grasp, friction=FRICTION), gc.force_closure(grasp, friction=0.01),
        gc.critical_friction_interval(grasp),
        gc.certify_regions(body, grasp, FRICTION, max_cones=64),
        gc.ferrari_canny(grasp, friction=FRICTION, torque_scale=body.radius),
        scenes.build_scene(body, grasp, FRICTION), sv.validate(body, grasp, FRICTION),
        gc.transfer(body, body, [grasp], FRICTION),
    ]  # fmt: skip


def test_fields_decide():
    one = Value(parts=(Value(), np.ones(2)), table={"k": np.zeros(2)}, size=np.nan)
    assert one == copy.deepcopy(one)
    assert one == replace(one, seconds=7.0)
    for change in (
        {"name": "b"},
        {"numbers": np.arange(4.0)},
        {"numbers": np.array([0.0, 1.0, 2.0 + 1e-15])},
        {"numbers": None},
        {"parts": (Value(name="b"), np.ones(2))},
        {"parts": (Value(),)},
        {"table": {"k": np.ones(2)}},
        {"table": {"l": np.zeros(2)}},
        {"size": 1.0},
    ):
        assert one != replace(one, **change)
    assert one != "a"
    assert one != copy.deepcopy(one).parts[0]


def test_hashes_tell_points_apart_and_do_not_depend_on_the_sign_of_zero_or_on_what_is_no_number():
    points = np.random.default_rng(0).normal(size=(500, 3))
    assert len({hash(Value(numbers=point)) for point in points}) == 500
    nothing = Value(numbers=np.array([np.nan, 1.0, 2.0]))
    assert nothing == copy.deepcopy(nothing)
    assert hash(nothing) == hash(copy.deepcopy(nothing))
    for one, other in ((0.0, -0.0), (1.0, 1)):
        assert hash(Value(numbers=np.array(one))) == hash(Value(numbers=np.array(other)))
    assert Value(numbers=np.array([0.0])) == Value(numbers=np.array([-0.0]))
    assert len({Value(), Value(), Value(name="b")}) == 2


def test_every_result_equals_its_copy_and_no_other(results):
    for result in results:
        again = copy.deepcopy(result)
        assert again == result
        assert hash(again) == hash(result)
        assert sum(result == other for other in results) == 1


def test_a_result_with_another_number_is_another_result(results):
    changed = 0
    for result in results:
        for each in fields(result):
            value = getattr(result, each.name)
            if each.compare and type(value) is float and each.init:
                other = copy.copy(result)
                object.__setattr__(other, each.name, np.nextafter(value, np.inf))
                assert other != result, (type(result), each.name)
                changed += 1
    assert changed > 20


def test_public_dataclasses_with_arrays_are_compared_by_value():
    for package in (gc, scenes, sv):
        for name in package.__all__:
            kind = getattr(package, name)
            if isinstance(kind, type) and is_dataclass(kind):
                assert kind.__eq__ is not object.__eq__, name


def test_what_is_shown_stays_on_its_line_however_long_its_names_and_reasons_are():
    body = replace(example_object("box"), name="a\nb" * 1000)
    plan = gc.plan(
        example_object("box"),
        0.5,
        families=("concurrent",),
        settings=gc.PlanSettings(cones="normal"),
    )
    for each in (body, replace(plan, absence="no grasp " * 1000)):
        assert len(repr(each)) <= MOST_TEXT
        assert "\n" not in repr(each)
