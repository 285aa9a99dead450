import numpy as np
import pytest

import grasp_core as gc
from grasp_core.execution.loads import Reactions
from tests.grasp_core.execution.held import planned_grips

G = 9.80665


def sets(grip):
    """A ball of forces, any wrenches, and a ball of forces and some torques about an offset."""
    size = np.repeat([1.0, grip.size], 3)
    yield gc.any_direction(0.2)
    yield gc.LoadSet(np.zeros(6), np.diag(size))
    yield gc.LoadSet([0, 0, -0.3, 0, 0, 0], np.diag(size)[:, [0, 2, 3, 5]])


def cases():
    for grip in planned_grips(stiffness=1500.0):
        for loads in sets(grip):
            yield grip, loads, Reactions.of(grip, loads)


def test_any_reactions_have_their_worst_angle_found():
    """Random rows, also of few or no changes, against a fine grid."""
    rng = np.random.default_rng(3)
    grid = np.tile(np.linspace(0.0, 2.0 * np.pi, 3_601), (300, 1))
    change = rng.normal(size=(300, 3, 4)) * rng.choice([0.0, 0.01, 1.0], size=(300, 3, 1))
    start = np.column_stack([rng.uniform(0.2, 2.0, 300), 0.1 * rng.normal(size=(300, 2))])
    reactions = Reactions(start, change, rng.choice([0.0, 0.05, 0.5, 2.0], size=300))
    _, found = reactions.worst_angles()
    brute = reactions.scales(grid).min(axis=1)
    held = np.isfinite(brute) & (brute > 0.0)
    assert held.sum() > 120
    assert found[held] == pytest.approx(brute[held], rel=1e-4)
    assert (found[held] <= brute[held] * (1.0 + 1e-12)).all()
    assert (found[brute == np.inf] == np.inf).all()
    assert (found[brute < 0.0] < 0.0).all()


def test_multipliers_prove_below_the_worst_scale_and_none_do_above():
    """By the S-lemma no multiplier at all proves a scale that is not survived; 200 are tried."""
    for _, _, reactions in cases():
        scale = reactions.worst_angles()[1].min()
        for share in (0.0, 0.3, 0.99, 1.0 - 1e-7):
            assert reactions.survives(share * scale, reactions.multipliers(share * scale))
        above = (1.0 + 1e-5) * scale
        best = reactions.multipliers(above)
        assert not reactions.survives(above, best)
        for factor in np.geomspace(1e-3, 1e3, 200):
            assert not reactions.survives(above, factor * best)
        assert not reactions.survives(0.5 * scale, -best)


def test_a_weight_in_any_direction_is_a_ball_and_a_known_one_the_offset_of_another():
    loads = gc.any_direction(0.5, 2.0)
    assert not loads.offset.any()
    assert loads.axes[:3] == pytest.approx(0.5 * (G + 2.0) * np.eye(3))
    assert not loads.axes[3:].any()
    loads = gc.any_direction(0.5, 2.0, gravity=[0.0, 0.0, -G])
    assert loads.offset == pytest.approx([0, 0, -0.5 * G, 0, 0, 0])
    assert loads.axes[:3] == pytest.approx(np.eye(3))
    with pytest.raises(gc.InputError, match="acceleration_m_per_s2 must be above zero where"):
        gc.any_direction(0.5, gravity=[0.0, 0.0, -G])
