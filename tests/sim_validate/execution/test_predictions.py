"""Predicted first slips, against a fine integration of the equation of motion and closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import eigh
from scipy.optimize import brentq

import grasp_core as gc
import scenes
from grasp_core.closure.contacts import cross_matrix
from scenes.settings import SAMPLE_S
from sim_validate.execution import paths
from sim_validate.execution.paths import TablePlane, idle
from sim_validate.execution.predictions import HeldDynamics
from sim_validate.execution.trials import Trial
from sim_validate.settings import ExecutionSettings
from tests.grasp_core.execution.held import planned_grips
from tests.sim_validate.execution.held_rigs import MASS, G, box_dynamics

DOWN = np.array([0.0, 0.0, -G])
LONG_S = 6.0


def predicted_slips(dynamics, drives):
    """The first slips alone."""
    return losses_of(dynamics, drives)[0]


def dynamics_of(name, push=8.0):
    (grip,) = planned_grips((name,), limit=1, push=push, tip_radius_m=0.005)
    held = scenes.HeldSettings(mass_kg=MASS)
    scene = scenes.build_held_scene(scenes.example_object(name), grip, held)
    return HeldDynamics(grip, scene.layout)


def slip_multiple(rest, change, friction):
    """The least s at which |t + s b| = mu (n + s a)."""

    def room(s):
        f = rest + s * change
        return (friction * f[:, 0] - np.linalg.norm(f[:, 1:], axis=1)).min()

    high = next((s for s in 2.0 ** np.arange(20) if room(s) < 0.0), np.inf)
    return brentq(room, 0.0, high, xtol=1e-15) if high < np.inf else np.inf


def integrated(dynamics, drive):
    """The least multiple of all samples and the farthest motion, integrated as the palm sees it.

    The kinetic energy of the object and of tips that move with their contacts gives the mass
    matrix; springs and dampers act at the contacts. Each tip obeys Newton's law by itself.
    """
    grip, layout = dynamics.grip, dynamics.layout
    jacobians = [np.hstack([np.eye(3), -cross_matrix(arm)]) for arm in grip.arms]
    m_t = layout.tip_mass_kg
    inertia = np.zeros((6, 6))
    inertia[:3, :3], inertia[3:, 3:] = layout.object_kg * np.eye(3), layout.inertia_kg_m2
    dampers = [
        axes @ np.diag(own) @ axes.T for axes, own in zip(layout.axes, layout.damping, strict=True)
    ]
    mass = inertia + m_t * sum(J.T @ J for J in jacobians)
    damping = sum(J.T @ C @ J for J, C in zip(jacobians, dampers, strict=True))
    least, farthest = np.inf, np.zeros(2)
    state, turning = np.zeros(12), np.zeros(3)
    for sample in range(len(drive)):
        palm = drive.accelerations[sample]
        o = turning + 0.5 * SAMPLE_S * palm[3:]
        turning = turning + SAMPLE_S * palm[3:]
        bases = [
            palm[:3] + np.cross(palm[3:], c) + (o @ c) * o - (o @ o) * c for c in layout.tip_centers
        ]
        load = drive.wrenches[sample] - inertia @ palm
        load[3:] -= np.cross(o, layout.inertia_kg_m2 @ o)
        load[:3] += layout.object_kg * drive.gravity[sample]
        load = load - m_t * sum(J.T @ a for J, a in zip(jacobians, bases, strict=True))

        def rate(_, y, load=load):
            push = load - grip.grasp_stiffness @ y[:6] - damping @ y[6:]
            return np.concatenate([y[6:], np.linalg.solve(mass, push)])

        state = solve_ivp(rate, (0.0, SAMPLE_S), state, rtol=1e-9, atol=1e-13).y[:, -1]
        moved, speed = state[:6], state[6:]
        force = rate(0.0, state)[6:]
        change = []
        for i, J in enumerate(jacobians):
            spring = grip.stiffness[i] @ J @ moved + dampers[i] @ J @ speed
            world = -spring - m_t * (J @ force + bases[i]) - np.cross(moved[3:], grip.squeeze[i])
            change.append(grip.frames[i].T @ world)
        least = min(least, slip_multiple(grip.local_squeeze, np.array(change), grip.friction))
        farthest = np.maximum(farthest, np.linalg.norm(moved.reshape(2, 3), axis=1))
    return least, *farthest


def drives():
    """Short ones of every kind, none of which turns the palm so far that gravity is seen to."""
    shaken = paths.shake(DOWN, np.array([6.0, 3.0, 0, 0, 0, 0]), 12.0)
    turning = paths.shake(0.0 * DOWN, np.array([0, 0, 0, 0.0, 0.0, 40.0]), 12.0)
    stopped = paths.stop(DOWN, np.array([0.0, 0.6, 0.8]), 10.0, 0.5)
    struck = paths.knock(DOWN, np.array([0.02, 0.01, 0.0]), np.array([0.0, 0.02, 0.01]))
    return {"shake": shaken, "turn": turning, "stop": stopped, "knock": struck}


@pytest.mark.parametrize(
    ("name", "kind"), [("box", "shake"), ("box", "turn"), ("wedge", "stop"), ("wedge", "knock")]
)
def test_predictions_are_those_of_a_fine_integration(name, kind):
    dynamics, drive = dynamics_of(name), drives()[kind]
    (found,) = dynamics.expected([drive])
    seen = (found.first_slip, found.moved_m, found.turn_rad)
    assert seen == pytest.approx(integrated(dynamics, drive), rel=1e-5)
    assert found.first_slip < 1e3


@pytest.mark.parametrize("name", ["box", "wedge"])
def test_slow_loads_slip_where_the_static_analysis_says(name):
    """Loads that grow over six seconds, some sixty periods of the slowest mode."""
    dynamics = dynamics_of(name)
    count = paths.samples(LONG_S)
    rng = np.random.default_rng(0)
    slow = []
    for _ in range(4):
        wrench = rng.normal(size=6) * np.repeat([1.0, dynamics.grip.size], 3)
        drive = replace(idle(count), wrenches=paths.smooth(count)[:, None] * wrench)
        slow.append((wrench, drive))
    found = predicted_slips(dynamics, [drive for _, drive in slow])
    for multiple, (wrench, _) in zip(found, slow, strict=True):
        expected = gc.first_slip(dynamics.grip, wrench, model="linear").multiple
        assert multiple == pytest.approx(expected, rel=2e-3)


def test_the_lowest_frequency_is_that_of_the_slowest_mode():
    for dynamics in (dynamics_of("wedge"), box_dynamics()):
        stiff = dynamics.grip.grasp_stiffness
        least = eigh(0.5 * (stiff + stiff.T), dynamics.mass, eigvals_only=True)[0]
        assert dynamics.lowest_frequency == pytest.approx(np.sqrt(least), rel=1e-8)
    layout = box_dynamics().layout
    along = np.sqrt(4 * 2000.0 / (MASS + 4 * layout.tip_mass_kg))
    assert box_dynamics().lowest_frequency <= along


def test_nothing_slips_where_nothing_acts():
    assert predicted_slips(box_dynamics(), [idle(20)]) == [np.inf]
    assert len(predicted_slips(box_dynamics(), [])) == 0


def test_a_table_carries_the_weight_until_the_lift():
    """With a share of zero throughout, the weight is never felt; with shares it is."""
    drive = replace(idle(100), gravity=np.tile(DOWN, (100, 1)))
    table = TablePlane(np.array([0.0, 0.0, -0.03]), np.array([0.0, 0.0, 1.0]))
    resting, hanging = predicted_slips(box_dynamics(), [replace(drive, table=table), drive])
    assert resting == np.inf
    assert hanging < 4 * 0.5 * 5.0 / (MASS * G)


def test_an_unstable_grip_slips_at_once():
    dynamics = box_dynamics(push=500.0, stiffness=1000.0)
    assert not dynamics.grip.stable
    assert predicted_slips(dynamics, list(drives().values())).tolist() == [0.0] * 4


def losses_of(dynamics, drives, most_m=5e-3, most_rad=0.09, turning=False):
    settings = ExecutionSettings(
        mass_kg=MASS, max_mm=1000.0 * most_m, max_deg=math.degrees(most_rad)
    )
    trials = [Trial("weight", "weight", drive, 0, turning=turning) for drive in drives]
    return np.reshape(dynamics.losses(trials, settings), (-1, 2)).T


@pytest.mark.parametrize("name", ["box", "wedge"])
def test_an_object_is_lost_after_the_first_slip_and_before_it_moves_too_far_without_any(name):
    dynamics, several = dynamics_of(name), list(drives().values())
    slips, losses = losses_of(dynamics, several)
    assert slips == pytest.approx(predicted_slips(dynamics, several), rel=1e-12)
    found = dynamics.expected(several)
    sticking = [1.0 / max(one.moved_m / 5e-3, one.turn_rad / 0.09) for one in found]
    assert (losses <= np.array(sticking) * (1 + 1e-9)).all()
    assert (losses >= np.minimum(slips, sticking)).all()
    assert (losses > 1.01 * np.minimum(slips, sticking)).any()
    (_, safer) = losses_of(dynamics, several, turning=True)
    assert safer == pytest.approx(np.minimum(slips, sticking), rel=1e-12)
