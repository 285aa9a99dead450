"""Settings that are broken on purpose: none must get as far as a grasp, which would be blamed."""

import pytest

import grasp_core as gc
import scenes
from sim_validate.closure.validate import simulated_critical_friction
from sim_validate.closure.verdict import AGREEMENT
from sim_validate.engine.gate import require_faithful
from sim_validate.engine.setup import Setup
from tests.marks import MORE, more

USUAL, TINY = 0.07, 5e-4
"""Radius of the object under test [m]."""
GATE, RANGE = gc.UnfaithfulError, gc.InputError
EVERYDAY = (
    ("pads", "physics", {"solver": "CG"}, GATE),
    ("pads", "physics", {"tolerance": 1e-4}, GATE),
    ("pads", "hold", {"hold_threshold": 1e-6}, GATE),
    ("object", "physics", {"ccd_iterations": 1}, GATE),
    ("pads", "hold", {"control_load": 1e-6}, RANGE),
    ("pads", "hold", {"least_normal_share": 0.5}, RANGE),
    ("pads", "hold", {"least_excess": 1e-8}, RANGE),
    ("pads", "physics", {"gravity": [0.0, 0.0, -9.81]}, RANGE),
    ("pads", "physics", {"condim": 1}, RANGE),
)
SLOW = (
    ("pads", "physics", {"timestep": 0.01}, RANGE),
    ("pads", "physics", {"solref": [0.02, 1.0]}, GATE),
    ("pads", "physics", {"wind": [10.0, 0.0, 0.0], "density": 1000.0}, GATE),
    ("object", "physics", {"margin": 1e-3}, GATE),
    ("pads", "fingers", {"fingertip_mass_kg": 1e6}, GATE),
    ("pads", "fingers", {"stiffness_n_per_m": 10.0}, GATE),
    ("pads", "hold", {"gap_threshold": 1.0}, GATE),
    ("pads", "limit", {"ramp_threshold": 0.01}, GATE),
    ("pads", "friction", {"spans": [0.9], "rounds": 1}, GATE),
)
"""One or two of each kind and each table that are not tried every day."""
REST = (
    ("pads", "physics", {"impratio": 10.0}, GATE),
    ("pads", "physics", {"solver": "PGS"}, GATE),
    ("pads", "physics", {"iterations": 1}, GATE),
    ("pads", "physics", {"ls_iterations": 1}, GATE),
    ("pads", "physics", {"tolerance": 1e-8}, GATE),
    ("pads", "physics", {"solref": [0.1, 1.0]}, GATE),
    ("pads", "physics", {"margin": 1e-3}, GATE),
    ("object", "physics", {"ccd_iterations": 5}, GATE),
    ("object", "physics", {"ccd_tolerance": 0.01}, GATE),
    ("pads", "fingers", {"fingertip_mass_kg": 1e-6}, GATE),
    ("pads", "fingers", {"stiffness_n_per_m": 1e6}, GATE),
    ("pads", "hold", {"total_threshold": 1e-6}, GATE),
    ("pads", "limit", {"ramp_threshold": 1e-9}, GATE),
    ("pads", "limit", {"spans": [0.9], "rounds": 1}, GATE),
    ("pads", "friction", {"threshold": 1e-9}, GATE),
)
AT_SMALL_SIZE = (
    ("pads", "physics", {"tolerance": 1e-12}, GATE),
    ("object", "physics", {"ccd_tolerance": 1e-3}, GATE),
    ("pads", "physics", {"integrator": "implicit"}, GATE),
    ("pads", "physics", {"integrator": "implicitfast"}, GATE),
)
"""They would do for objects of some centimetres."""


RIGHT = (
    ("physics", {"timestep": 0.003}),
    ("hold", {"squeeze_s": 0.05}),
    ("physics", {"timestep": 0.001}),
    ("physics", {"timestep": 0.002}),
    ("physics", {"integrator": "Euler"}),
    ("physics", {"integrator": "RK4"}),
    ("hold", {"squeeze_s": 0.1}),
)
"""They give the verdicts of the usual settings, on objects of every size."""


def refusal(surface, table, numbers, radius_m, friction=0.5):
    """The error that stops these settings, None if nothing does."""
    try:
        setup = Setup.of_table({table: numbers}, usual=Setup(surface=surface))
        require_faithful(setup, friction, radius_m)
    except gc.GraspError as error:
        return error
    return None


@pytest.mark.parametrize(("surface", "table", "numbers", "kind"), EVERYDAY)
def test_broken_settings_are_refused_before_a_grasp_is_simulated(surface, table, numbers, kind):
    error = refusal(surface, table, numbers, USUAL)
    assert isinstance(error, kind)
    if kind is RANGE:
        assert next(iter(numbers)) in str(error)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("surface", "table", "numbers", "kind"),
    [*SLOW, *(pytest.param(*case, marks=MORE) for case in REST)],
)
def test_so_are_more_of_them(surface, table, numbers, kind):
    assert isinstance(refusal(surface, table, numbers, USUAL), kind)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("surface", "table", "numbers", "kind"),
    [*AT_SMALL_SIZE[:2], *(pytest.param(*case, marks=MORE) for case in AT_SMALL_SIZE[2:])],
)
def test_what_is_too_coarse_for_a_small_object_is_refused_there(surface, table, numbers, kind):
    assert refusal(surface, table, numbers, USUAL, 1.0) is None
    assert type(refusal(surface, table, numbers, TINY, 1.0)) is kind


@pytest.mark.slow
@pytest.mark.parametrize(
    ("table", "numbers"),
    [*RIGHT[:2], *(pytest.param(*case, marks=MORE) for case in RIGHT[2:])],
)
def test_settings_that_are_right_are_accepted(table, numbers):
    for radius_m in (TINY, USUAL, 1.0):
        assert refusal("object", table, numbers, radius_m) is None


BRACKET_TABLES = (
    {}, {"physics": {"timestep": 0.003}}, {"physics": {"timestep": 0.004}},
    {"physics": {"timestep": 0.005}}, {"hold": {"squeeze_s": 0.05}},
)  # fmt: skip


@pytest.mark.parametrize(
    "tables", [BRACKET_TABLES[0], BRACKET_TABLES[3], *more(*BRACKET_TABLES[1:3], BRACKET_TABLES[4])]
)
def test_long_steps_and_a_hasty_squeeze_do_not_tilt_a_lightly_held_bracket(tables):
    """Two of its fingers push with 4e-4 of the others; tilted, it lets go too early."""
    example = scenes.example_object("l-bracket")
    for radius_m in (5e-4, 0.05):
        vertices = example.vertices * radius_m / example.radius
        body = gc.Polyhedron.from_mesh(vertices, example.triangles, name=example.name)
        grasp = gc.plan(body, 0.5, limit=1).grasps[0]
        found = simulated_critical_friction(body, grasp, Setup.of_table(tables, usual=Setup()))
        assert found == pytest.approx(grasp.critical_friction, rel=AGREEMENT)
