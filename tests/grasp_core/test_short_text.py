"""Values of thousands of numbers are shown in a line or two, with what tells them apart."""

import dataclasses

import numpy as np
import pytest

import grasp_core as gc
import scenes
import sim_validate as sv
from grasp_core.by_value import counted, summary, vector
from scenes.example_objects import example_object

TWO_LINES = 300
"""Characters."""


@pytest.fixture(scope="module")
def planned():
    body = example_object("wedge")
    return body, gc.plan(body, 0.5, families=("concurrent",), limit=3)


def test_plans_objects_and_grasps_are_shown_in_two_lines(planned):
    body, plan = planned
    grasp = plan.grasps[0]
    values = [
        body, plan, grasp, grasp.witness, body.faces[0], *grasp.contacts, *grasp.force_cones,
        *grasp.regions, plan.counts, plan.outcomes,
    ]  # fmt: skip
    for value in values:
        said = repr(value)
        assert said.startswith(type(value).__name__ + "(")
        assert len(said) <= (2 * TWO_LINES if value is plan.counts else TWO_LINES)
        assert "\n" not in said
    assert len(values) == 19


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
