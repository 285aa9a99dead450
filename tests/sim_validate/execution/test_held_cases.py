"""Executions are refused with settings that do not give the answers of mechanics."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
import scenes
import sim_validate as sv
from scenes.mujoco.held_scene import gravity_of
from scenes.settings import HeldSettings
from sim_validate.engine.known_cases import measured
from sim_validate.execution.held_cases import HeldCase, cases_of

USUAL, STIFF, SOFT = (0.3, 2000.0, 0.07), (0.05, 10_000.0, 0.02), (2.0, 500.0, 0.2)
"""Mass of the object [kg], stiffness of the springs [N/m], radius of the object [m]."""


def held_case(mass_kg, stiffness_n_per_m, radius_m, **more):
    """The usual case with a mass, a stiffness and a size, and the physics that suit them."""
    fields = {
        "push_n": 10.0, "friction": 0.5, "tip_radius_m": 0.1 * radius_m, "tip_mass_kg": 0.05,
        "damping_ratio": 0.5, "physics": None,
    } | more  # fmt: skip
    case = HeldCase(mass_kg, stiffness_n_per_m, radius_m=radius_m, **fields)
    if case.physics is None:
        own = case.held_scene().physics
        case = held_case(mass_kg, stiffness_n_per_m, radius_m, **(more | {"physics": own}))
    return case


DEFAULTS = {
    "cone": "pyramidal", "impratio": 1.0, "integrator": "Euler", "tolerance": 1e-8,
    "solref": (0.02, 1.0), "solimp": (0.9, 0.95, 0.001, 0.5, 2.0), "timestep": 0.0025,
}  # fmt: skip
"""MuJoCo's own defaults, with the nearest step that divides a sample; executions are refused."""
BROKEN = (
    (USUAL, {"timestep": 0.005}),
    (USUAL, {"impratio": 0.1}),
    (SOFT, {"iterations": 2}),
    (USUAL, {"solver": "CG"}),
    (USUAL, {"condim": 1}),
)
"""One of several kinds, for every day."""
MORE_BROKEN = (
    (USUAL, DEFAULTS),
    (STIFF, {"timestep": 0.0025}),
    (USUAL, {"integrator": "discrete"}),
    (USUAL, {"cone": "pyramidal"}),
    (STIFF, {"solref": (0.02, 1.0)}),
    (USUAL, {"ls_iterations": 1}),
    (USUAL, {"viscosity": 0.1}),
    (USUAL, {"density": 1.2, "wind": (10.0, 0.0, 0.0)}),
    (USUAL, {"ccd_tolerance": 0.01}),
)
CORNERS = ((0.05, 500.0, 0.2), (0.05, 10_000.0, 0.2), (2.0, 500.0, 0.02), (2.0, 10_000.0, 0.02))
"""Masses, stiffnesses and sizes that differ most from those of every day."""
MORE_RIGHT = (
    *((where, {}) for where in CORNERS),
    (USUAL, {"integrator": "RK4"}),
    (USUAL, {"impratio": 1000.0}),
    (USUAL, {"autoreset": True}),
)
"""The last ones change nothing that matters: a blow-up that is reset is still reported."""


def slow(cases):
    return [pytest.param(*case, marks=pytest.mark.slow) for case in cases]


def refused(where, numbers):
    case = held_case(*where)
    gate = measured(replace(case, physics=replace(case.physics, **numbers)))
    return [check for check in gate.checks if not check.passed]


def held(body, **more):
    grasp = gc.plan(body, 0.5, limit=1).grasps[0]
    settings = sv.ExecutionSettings(mass_kg=0.2, trials=("stop",), **more)
    return grasp, settings


def test_the_usual_settings_give_the_known_answers_and_every_figure_is_measured():
    gate = measured(held_case(*USUAL))
    assert gate.passed
    assert len(gate.checks) == 26
    assert len({check.name for check in gate.checks}) == 26
    for check in gate.checks:
        if check.least > 0.0:
            assert (check.least, check.largest) == (0.99, 1.01)


@pytest.mark.parametrize(("where", "numbers"), [(STIFF, {}), (SOFT, {}), *slow(MORE_RIGHT)])
def test_each_closed_form_is_met_at_all_masses_stiffnesses_and_sizes(where, numbers):
    assert not refused(where, numbers)


@pytest.mark.slow
def test_so_it_is_with_other_pushes_frictions_fingertips_and_dampers():
    rng = np.random.default_rng(1)
    least = np.log([0.01, 200.0, 0.01, 1.0, 0.1, 0.02, 0.005, 0.1])
    most = np.log([5.0, 2e4, 0.3, 50.0, 1.5, 0.3, 0.2, 2.0])
    drawn = np.exp(rng.uniform(least, most, (8, 8)))
    for m, k, r, push, friction, tip, tip_mass, damping in drawn.tolist():
        case = held_case(
            m, k, r, push_n=push, friction=friction, tip_radius_m=tip * r, tip_mass_kg=tip_mass,
            damping_ratio=damping,
        )  # fmt: skip
        assert [str(check) for check in measured(case).checks if not check.passed] == []


@pytest.mark.parametrize(("where", "numbers"), [*BROKEN, *slow(MORE_BROKEN)])
def test_broken_settings_are_refused(where, numbers):
    assert refused(where, numbers)


def test_no_grasp_is_executed_with_broken_settings():
    body = scenes.example_object("wedge")
    grasp, settings = held(body)
    contacts = [gc.Contact(each.position, each.normal) for each in grasp.contacts]
    best = gc.best_squeeze(body, contacts, 0.5, gc.any_direction(0.2), max_push_n=10.0)
    layout = scenes.build_held_scene(body, best.grip, scenes.HeldSettings(mass_kg=0.2))
    physics = replace(layout.physics, cone="pyramidal")
    with pytest.raises(gc.UnfaithfulError, match=r"nothing is simulated.*obliquely.*OUT OF TOL"):
        sv.execute(body, grasp, 0.5, settings, physics=physics)
    with pytest.raises(gc.InputError, match=r"physics\.gravity must be that of the settings"):
        sv.execute(body, grasp, 0.5, settings, physics=replace(physics, gravity=(0.0, 0.0, -9.0)))
    with pytest.raises(gc.InputError, match="physics"):
        sv.execute(body, grasp, 0.5, settings, physics={"cone": "elliptic"})


def test_settings_are_measured_once_whatever_the_direction_of_gravity():
    case = held_case(*USUAL)
    scene = case.held_scene()
    hand = HeldSettings(down=(1.0, 0.0, 0.0))
    (first,) = cases_of(scene.layout, scene.physics, HeldSettings(), 10.0)
    turned = replace(scene.physics, gravity=tuple(gravity_of(hand).tolist()))
    nearly = replace(scene.layout, object_kg=1.001 * scene.layout.object_kg)
    (second,) = cases_of(nearly, turned, hand, 10.0)
    assert measured(first) is measured(second)


def test_each_friction_of_a_scene_is_measured():
    scene = held_case(*USUAL).held_scene()
    layout = replace(scene.layout, friction=np.array([0.3, 0.3, 0.6, 0.301]))
    cases = cases_of(layout, scene.physics, HeldSettings(), 10.0)
    assert [case.friction for case in cases] == [0.3, 0.6]


def test_a_push_that_springs_are_too_soft_for_is_lowered():
    case = held_case(*SOFT)
    assert case.push < case.push_n
    assert case.halves == pytest.approx(0.2 / 0.0659545 * np.array([0.05, 0.035, 0.025]), rel=1e-5)
