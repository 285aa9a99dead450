"""The simulator is measured on known cases; settings that are broken get as far as no grasp."""

import re
from dataclasses import replace

import pytest

import grasp_core as gc
import scenes
import sim_validate as sv
from scenes.mujoco_options import PhysicsSettings
from sim_validate.engine.closure_cases import ClosureCase
from sim_validate.engine.kept_gates import checked
from sim_validate.engine.known_cases import measured, untouching
from sim_validate.engine.setup import Setup
from sim_validate.engine.stepping import Bench
from tests.sim_validate.rigs import grasps

USUAL, TINY = 0.07, 5e-4
"""Radius of the object under test [m]."""
BODY = scenes.example_object("tetrahedron")
"""The object of those tests whose gate is measured with the usual settings."""
EVERYDAY = (
    ("physics", {"cone": "pyramidal"}, "slides.*slips"),
    ("limit", {"ramp_threshold": 1e-2}, "slips.*by ramps"),
)
"""Tables of settings, broken numbers, and words of the figures that show it."""
DEFAULTS = {
    "cone": "pyramidal", "impratio": 1.0, "integrator": "Euler", "tolerance": 1e-8,
    "solref": (0.02, 1.0), "solimp": (0.9, 0.95, 0.001, 0.5, 2.0),
}  # fmt: skip
SLOW = (
    ("physics", {"ccd_iterations": 1}, ""),
    ("hold", {"hold_threshold": 0.1, "total_threshold": 0.2, "gap_threshold": 0.1}, "slides"),
    ("physics", DEFAULTS, "slides.*slips.*creep"),
    ("physics", {"integrator": "implicitfast", "tolerance": 1e-8}, "slips.*let go"),
    ("physics", {"autoreset": True}, "blow-up"),
    ("physics", {"solver": "CG"}, "last digit"),
    ("physics", {"impratio": 1.0}, "creep"),
    ("physics", {"solref": (0.02, 1.0)}, ""),
    ("physics", {"wind": (10.0, 0.0, 0.0), "density": 1000.0}, ""),
    ("physics", {"margin": 1e-3}, ""),
    ("fingers", {"fingertip_mass_kg": 1e6}, ""),
    ("fingers", {"stiffness_n_per_m": 10.0}, ""),
    ("hold", {"hold_threshold": 1e-6}, ""),
    ("friction", {"threshold": 1e-2}, "hidden"),
)
"""One or two of each kind and each table that are not tried every day."""


def setup_of(table, numbers):
    return Setup.of_table({table: numbers}, usual=Setup(surface="object"))


def test_the_usual_settings_are_faithful_and_every_figure_is_measured():
    """On the object, how fingertips touch its faces is measured too."""
    case = ClosureCase.of(Setup(), 0.5, BODY.radius)
    gate = checked(case)
    assert gate.passed
    assert gate == measured(case)  # although it may come from a file
    assert len(gate.checks) == 21
    for check in gate.checks:
        assert check.least <= check.value < check.largest
        assert str(check).endswith("ok")
    assert len(checked(ClosureCase.of(Setup(surface="pads"), 0.5, BODY.radius)).checks) == 19
    fingers = scenes.FingerSettings(fingertip_radius_m=0.01)
    other = Setup(surface="object", threads=2, timeout_s=5.0, fingers=fingers)
    assert checked(ClosureCase.of(other, 0.5, BODY.radius)) is gate  # it is looked up once


@pytest.mark.parametrize(
    ("table", "numbers", "words"),
    [
        *EVERYDAY,
        *(pytest.param(*case, marks=pytest.mark.slow) for case in SLOW),
    ],
)
def test_broken_settings_are_refused_with_the_figures(table, numbers, words):
    with pytest.raises(gc.UnfaithfulError, match=words or None) as caught:
        checked(ClosureCase.of(setup_of(table, numbers), 0.5, BODY.radius))
    assert "OUT OF TOLERANCE" in str(caught.value)


def test_nothing_is_validated_with_broken_settings():
    body, (grasp, *_) = grasps(BODY.name, 0.5, 1)
    setup = setup_of(*EVERYDAY[0][:2])
    with pytest.raises(gc.UnfaithfulError):
        sv.validate(body, grasp, 0.5, setup=setup)
    with pytest.raises(gc.UnfaithfulError):
        sv.simulated_critical_friction(body, grasp, setup)


@pytest.mark.slow
@pytest.mark.parametrize(("table", "numbers"), [
    ("physics", {"tolerance": 1e-12}), ("physics", {"ccd_tolerance": 1e-3}),
    ("fingers", {"fingertip_mass_kg": 1.0, "stiffness_n_per_m": 1000.0}),
])  # fmt: skip
def test_what_suits_objects_of_some_centimetres_is_refused_for_small_ones(table, numbers):
    setup = setup_of(table, numbers)
    assert measured(ClosureCase.of(setup, 1.0, USUAL)).passed
    assert not measured(ClosureCase.of(setup, 1.0, TINY)).passed


@pytest.mark.slow
@pytest.mark.parametrize(("table", "numbers", "friction", "radius_m"), [
    *(("physics", {"timestep": 0.003}, 0.5, radius_m) for radius_m in (TINY, USUAL, 1.0)),
    ("hold", {"squeeze_s": 0.05}, 0.5, TINY),
    ("fingers", {"max_normal_force_n": 200.0}, 0.02, 7e-4),
    ("fingers", {"max_normal_force_n": 0.5}, 2.0, 7.0),
])  # fmt: skip
def test_the_gate_passes_at_other_steps_frictions_sizes_and_forces(
    table, numbers, friction, radius_m
):
    """Masses and stiffness scale with sizes and forces."""
    assert measured(ClosureCase.of(setup_of(table, numbers), friction, radius_m)).passed


def test_contacts_that_the_simulator_does_not_find_are_not_blamed_on_the_grasp():
    """A ball of many facets takes more iterations than the known cases do."""
    body = scenes.example_object("random-200-1")
    contacts = [gc.Contact(face.centroid, face.normal) for face in body.faces[:12]]
    few = Setup(surface="object", physics=replace(PhysicsSettings(), ccd_iterations=5))
    assert not untouching(Bench(Setup(surface="object").scene(body, contacts, 0.5)))
    said = untouching(Bench(few.scene(body, contacts, 0.5)))
    assert re.search(r"does not touch the object.*ccd_iterations", said[0])
    assert not untouching(Bench(replace(few, surface="pads").scene(body, contacts, 0.5)))
