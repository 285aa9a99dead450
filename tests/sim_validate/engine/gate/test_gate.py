from dataclasses import replace

import pytest

import grasp_core as gc
import scenes
import sim_validate as sv
from scenes.settings import PhysicsSettings
from sim_validate.engine.bench import Bench
from sim_validate.engine.gate import measured_gate, require_faithful, require_touch
from sim_validate.engine.setup import Setup
from sim_validate.settings import FrictionProtocol, HoldProtocol, LimitProtocol
from tests.marks import more
from tests.sim_validate.rigs import grasps

GOOD = PhysicsSettings()
DEFAULTS = PhysicsSettings(
    cone="pyramidal", impratio=1.0, integrator="Euler", tolerance=1e-8,
    solref=(0.02, 1.0), solimp=(0.9, 0.95, 0.001, 0.5, 2.0),
)  # fmt: skip
BROKEN = {
    "pyramidal cones": (Setup(physics=replace(GOOD, cone="pyramidal")), "slides.*slips"),
    "autoreset": (Setup(physics=replace(GOOD, autoreset=True)), "blow-up"),
    "implicitfast at the default tolerance": (
        Setup(physics=replace(GOOD, integrator="implicitfast", tolerance=1e-8)), "slips.*let go",
    ),
    "all of MuJoCo's defaults": (Setup(physics=DEFAULTS), "slides.*slips.*creep"),
    "soft friction": (Setup(physics=replace(GOOD, impratio=1.0)), "creep"),
    "few noslip iterations": (
        Setup(physics=replace(GOOD, impratio=1.0, noslip_iterations=5)), "creep"
    ),
    "conjugate gradients": (Setup(physics=replace(GOOD, solver="CG")), "last digit"),
    "holds that hide a hundred times more": (
        Setup(hold=HoldProtocol(hold_threshold=0.02, total_threshold=0.02)), "hidden",
    ),
    "loose ramps": (Setup(limit=LimitProtocol(ramp_threshold=1e-2)), "slips.*by ramps"),
    "loose releases": (Setup(friction=FrictionProtocol(threshold=1e-2)), "hidden"),
    "thresholds of 5 mm": (
        Setup(hold=HoldProtocol(hold_threshold=0.1, total_threshold=0.2, gap_threshold=0.1)),
        "slides",
    ),
}  # fmt: skip
EVERYDAY = (
    "pyramidal cones", "soft friction", "conjugate gradients", "loose ramps", "thresholds of 5 mm",
)  # fmt: skip


def test_the_usual_settings_are_faithful_and_every_figure_is_measured():
    gate = require_faithful(Setup())
    assert gate.passed
    assert len(gate.checks) == 21
    for check in gate.checks:
        assert check.least <= check.value < check.largest
        assert str(check).endswith("ok")


@pytest.mark.parametrize(
    "name", [*EVERYDAY, *more(*(name for name in BROKEN if name not in EVERYDAY))]
)
def test_broken_settings_are_refused_with_the_figures(name):
    setup, says = BROKEN[name]
    with pytest.raises(gc.UnfaithfulError, match=says) as caught:
        require_faithful(setup)
    assert "OUT OF TOLERANCE" in str(caught.value)


def test_what_fingertips_touch_is_what_is_measured():
    """On the object, how fingertips touch its faces is measured too."""
    assert len(require_faithful(Setup(surface="pads")).checks) == 19
    own = require_faithful(Setup(surface="object"))
    assert len(own.checks) == 19 + 2
    assert require_faithful(Setup()).checks == own.checks


def test_contacts_that_the_simulator_does_not_find_are_not_blamed_on_the_grasp():
    """A ball of many facets takes more iterations than the known cases do."""
    body = scenes.example_object("random-200-1")
    contacts = [gc.Contact(face.centroid, face.normal) for face in body.faces[:12]]
    few = Setup(surface="object", physics=replace(GOOD, ccd_iterations=5))
    require_touch(Bench(Setup(surface="object").scene(body, contacts, 0.5)))
    with pytest.raises(gc.UnfaithfulError, match=r"does not touch the object.*ccd_iterations"):
        require_touch(Bench(few.scene(body, contacts, 0.5)))
    require_touch(Bench(replace(few, surface="pads").scene(body, contacts, 0.5)))


def test_nothing_is_validated_with_broken_settings():
    body, (grasp, *_) = grasps("tetrahedron", 0.5, 1)
    setup, _ = BROKEN["pyramidal cones"]
    with pytest.raises(gc.UnfaithfulError):
        sv.validate(body, grasp, 0.5, setup=setup)
    with pytest.raises(gc.UnfaithfulError):
        sv.simulated_critical_friction(body, grasp, setup)


def test_the_gate_is_measured_once_for_the_same_settings():
    first = measured_gate(Setup())
    fingers = scenes.FingerSettings(fingertip_radius_m=0.01)
    assert measured_gate(Setup(threads=2, timeout_s=5.0, fingers=fingers)) is first
    assert measured_gate(Setup(physics=replace(GOOD, timestep=0.001))) is not first


@pytest.mark.parametrize("force", [0.5, 200.0])
def test_the_gate_passes_at_other_forces(force):
    """Masses and stiffness scale with them."""
    fingers = scenes.FingerSettings(max_normal_force_n=force)
    assert measured_gate(Setup(fingers=fingers)).passed


def test_fingers_far_too_heavy_are_noticed():
    """A ton behind each fingertip does not move in half a second."""
    assert not measured_gate(Setup(fingers=scenes.FingerSettings(fingertip_mass_kg=1e6))).passed


@pytest.mark.parametrize("friction", [0.02, 2.0, *more(0.2)])
@pytest.mark.parametrize("radius_m", [7e-4, 7.0])
def test_the_gate_passes_at_other_frictions_and_sizes(friction, radius_m):
    assert measured_gate(Setup(), friction, radius_m).passed


def test_frictions_at_which_the_simulator_fails_are_refused():
    assert not measured_gate(Setup(), 100.0).passed


def test_given_masses_and_stiffnesses_are_judged_at_the_size_of_the_object():
    """What suits an object of 7 cm: 2 kg and 1000 N/m are far too much or too little for others."""
    fingers = scenes.FingerSettings(fingertip_mass_kg=1.0, stiffness_n_per_m=1000.0)
    assert measured_gate(Setup(fingers=fingers), radius_m=0.07).passed
    assert not measured_gate(Setup(fingers=fingers), radius_m=7e-4).passed
