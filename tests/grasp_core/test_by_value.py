import copy
import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace

import numpy as np
import pytest

import grasp_core as gc
import scenes
import sim_validate as sv
from grasp_core.by_value import ByValue, counted, summary, vector
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
    return scenes.example_object("wedge")


@pytest.fixture(scope="module")
def plan(body):
    return gc.plan(body, FRICTION)


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
        gc.critical_friction_interval(grasp), gc.certify_regions(body, grasp, FRICTION),
        gc.ferrari_canny(grasp, friction=FRICTION, torque_scale=body.radius),
        gc.quality_ceiling(body, grasp.faces, FRICTION), gc.best_grasp(body, FRICTION, gap=0.6),
        scenes.build_scene(body, grasp, FRICTION),
        sv.validate(body, grasp, FRICTION),
        sv.execute(body, grasp, FRICTION, mass_kg=0.2),
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


def test_equal_values_have_equal_hashes():
    zero = Value(numbers=np.array([0.0]))
    assert hash(zero) == hash(Value(numbers=np.array([-0.0])))
    assert zero == Value(numbers=np.array([-0.0]))
    assert len({Value(), Value(), Value(name="b")}) == 2


def test_hashes_tell_points_apart_and_do_not_depend_on_the_sign_of_zero_or_on_what_is_no_number():
    points = np.random.default_rng(0).normal(size=(500, 3))
    assert len({hash(Value(numbers=point)) for point in points}) == 500
    nothing = Value(numbers=np.array([np.nan, 1.0, 2.0]))
    assert nothing == copy.deepcopy(nothing)
    assert hash(nothing) == hash(copy.deepcopy(nothing))
    assert hash(Value(numbers=np.array(1.0))) == hash(Value(numbers=np.array(1)))


def test_lengths_of_an_equal_object_are_found_without_comparing_it(body, monkeypatch):
    again = copy.deepcopy(body)
    monkeypatch.setattr(gc.Polyhedron, "__eq__", None)
    assert (
        again.radius
        == body.radius
        == max(np.linalg.norm(body.vertices - body.center_of_mass, axis=1))
    )


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


def test_grasps_planned_twice_are_equal_and_figures_are_computed_only_if_compared(body, plan):
    again = gc.plan(body, FRICTION)
    assert hash(again[0]) == hash(plan[0])
    assert plan[0] != plan[1]
    assert again == plan
    assert again.grasps[3].critical_friction == plan[3].critical_friction


def test_every_result_is_shown_in_three_lines(results):
    for result in results:
        said = repr(result)
        assert said.startswith(type(result).__name__ + "(")
        assert len(said) <= 300
        assert "\n" not in said


def test_public_dataclasses_with_arrays_are_compared_by_value():
    for package in (gc, scenes, sv):
        for name in package.__all__:
            kind = getattr(package, name)
            if isinstance(kind, type) and is_dataclass(kind):
                assert kind.__eq__ is not object.__eq__, name


TWO_LINES = 300
"""Characters."""


@pytest.fixture(scope="module")
def planned():
    body = example_object("wedge")
    return body, gc.plan(body, 0.5, families=("concurrent",), limit=3)


def test_they_say_what_tells_them_apart(planned):
    body, plan = planned
    assert repr(body) == "Polyhedron('wedge', 6 vertices, 8 triangles, 8 faces, radius=0.0677424)"
    assert repr(plan).startswith("Plan(3 grasps, 70 face quadruples searched: ")
    assert "friction=0.5" in repr(plan)
    assert len({repr(grasp) for grasp in plan.grasps}) == 3
    for grasp in plan.grasps:
        assert repr(grasp).startswith(f"Grasp({grasp.id!r}, concurrent, faces={grasp.faces}, ")
        assert f"critical_friction={grasp.critical_friction:.6g}" in repr(grasp)


def test_a_contact_shows_its_numbers():
    contact = gc.Contact(np.array([0.1, -0.0, 1e-19]), np.array([0.0, 0.0, -1.0]))
    assert repr(contact) == "Contact(position=(0.1, 0, 0), normal=(0, 0, -1))"
    cone = gc.ForceCone(np.array([1.0, 0.0, 0.0]), 0.25)
    assert repr(cone) == "ForceCone(axis=(1, 0, 0), half_angle=0.25)"


def test_why_there_is_no_grasp_is_shown_and_cut():
    plan = gc.plan(example_object("box"), 0.5, families=("concurrent",), cones="normal")
    assert plan.absence[:60] in repr(plan)
    long = dataclasses.replace(plan, absence="no grasp " * 1000)
    assert len(repr(long)) <= 2 * TWO_LINES


def test_names_of_any_length_and_kind_stay_on_their_line():
    body = dataclasses.replace(example_object("box"), name="a\nb" * 1000)
    assert "\n" not in repr(body)
    assert len(repr(body)) <= TWO_LINES


def test_counts_and_figures():
    assert [counted(n, "hole") for n in (0, 1, 2)] == ["0 holes", "1 hole", "2 holes"]
    assert counted(3, "patch") == "3 patches"
    assert vector([]) == "()"
    assert vector([1.0, 1e-13, -2.5]) == "(1, 0, -2.5)"
    assert summary("A", "b", c=1.0, d=(1, 2)) == "A(b, c=1, d=(1, 2))"


def test_settings_show_what_differs_from_the_usual_ones():
    assert repr(sv.Setup()) == "Setup()"
    assert repr(sv.ExecutionSettings(mass_kg=0.3)) == "ExecutionSettings(mass_kg=0.3)"
    setup = sv.Setup(threads=2, physics=scenes.PhysicsSettings(timestep=0.001))
    assert repr(setup) == "Setup(physics=PhysicsSettings(timestep=0.001), threads=2)"
