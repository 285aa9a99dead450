import math

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.closure.contacts import grasp_map, normal_and_tangential
from grasp_core.errors import NoForcesError
from grasp_core.quality.contact_forces import contact_forces
from tests.grasp_core.quality.loads import LIMITS, SLACK, balanced_wrenches, batches, closed_just_so
from tests.judges import TETRA_CENTERS, TETRA_NORMALS, random_contacts


@pytest.mark.parametrize(
    ("objective", "count", "wrenches"), [("least_norm", 10, 4), ("least_friction", 5, 2)]
)
def test_a_batch_equals_its_single_calls_in_any_order(objective, count, wrenches):
    """To 1e-9 of the largest force. Least friction is found by the same steps, bit for bit."""
    for positions, normals, friction, limits, loads in batches(count, wrenches):
        options = {"objective": objective, "normal_force": limits}
        together = contact_forces(positions, normals, friction, loads, **options)
        backwards = contact_forces(positions, normals, friction, loads[::-1], **options)[::-1]
        alone = [contact_forces(positions, normals, friction, load, **options) for load in loads]
        assert together.shape == (len(loads), len(positions), 3)
        for one, other, single in zip(together, backwards, alone, strict=True):
            near = 1e-9 * np.abs(single).max()
            np.testing.assert_allclose(one, single, rtol=0.0, atol=near)
            np.testing.assert_allclose(other, single, rtol=0.0, atol=near)


@pytest.mark.parametrize("objective", ["least_norm", "least_friction"])
def test_one_friction_each_is_respected_and_alike_is_the_same_as_one_for_all(objective):
    rng = np.random.default_rng(6)
    for slippery in (0.0, 0.05, 0.2):
        positions, normals = random_contacts(rng, 5)
        friction = np.array([slippery, 0.3, 0.5, 0.8, 1.2])
        loads = balanced_wrenches(rng, positions, normals, friction, LIMITS, 3)
        options = {"objective": objective, "normal_force": LIMITS}
        forces = contact_forces(positions, normals, friction, loads, **options)
        for load, answer in zip(loads, forces, strict=True):
            along, across = normal_and_tangential(answer, normals)
            assert (across <= friction * along + SLACK).all()
            assert np.abs(grasp_map(positions) @ answer.ravel() + load).max() < SLACK
        alike = contact_forces(positions, normals, np.full(5, 1.2), loads, **options)
        one = contact_forces(positions, normals, 1.2, loads, **options)
        np.testing.assert_array_equal(alike, one)


def test_the_first_wrench_without_forces_is_named():
    loads = np.zeros((6, 6))
    loads[3, 0], loads[5, 0] = 100.0, 200.0
    for objective in ("least_norm", "least_friction"):
        options = {"objective": objective, "normal_force": (0.0, 10.0)}
        with pytest.raises(NoForcesError, match="balance wrench 3, counting from 0; lower"):
            contact_forces(TETRA_CENTERS, TETRA_NORMALS, 0.5, loads, **options)


@pytest.mark.parametrize("objective", ["least_norm", "least_friction"])
def test_no_wrench_needs_no_forces_and_next_to_none_a_mere_squeeze(objective):
    loose = contact_forces(TETRA_CENTERS, TETRA_NORMALS, 0.5, np.zeros(6), objective=objective)
    np.testing.assert_allclose(loose, np.zeros((4, 3)), atol=1e-9)
    none = np.empty((0, 6))
    found = contact_forces(TETRA_CENTERS, TETRA_NORMALS, 0.5, none, objective=objective)
    assert found.shape == (0, 4, 3)
    loads = np.vstack([np.zeros(6), 1e-12 * np.eye(6)])
    squeezed = contact_forces(
        TETRA_CENTERS, TETRA_NORMALS, 0.5, loads,
        objective=objective, normal_force=(0.5, math.inf),
    )  # fmt: skip
    for forces in squeezed:
        along, across = normal_and_tangential(forces, TETRA_NORMALS)
        assert (along >= 0.5 - SLACK).all()
        assert across.max() < 1e-6
        if objective == "least_norm":
            np.testing.assert_allclose(along, 0.5, rtol=1e-6)


def test_loads_far_below_the_limit_are_balanced_all_the_same():
    """A hundred-millionth of the limit: to no fewer digits than a large load."""
    rng = np.random.default_rng(31)
    wrenches = 1e-7 * rng.normal(size=(20, 6))
    forces = gc.contact_forces(
        TETRA_CENTERS, TETRA_NORMALS, 0.5, wrenches, normal_force=(0.0, 10.0)
    )
    total = forces.reshape(20, -1) @ grasp_map(TETRA_CENTERS).T + wrenches
    assert np.abs(total).max() < 1e-13
    pair = np.array([[1.0, 0, 0], [-1, 0, 0]])
    with pytest.raises(gc.NoForcesError):
        gc.contact_forces(pair, -pair, 0.5, [0, 0, 0, 9e-6, 0, 0], normal_force=(0.0, 10.0))
    with pytest.raises(gc.NoForcesError):
        gc.contact_forces(TETRA_CENTERS, TETRA_NORMALS, 0.0, [0, 0, 0, 9e-6, 0, 0])


@pytest.mark.parametrize("objective", ["least_norm", "least_friction"])
def test_contacts_in_closure_balance_every_wrench(objective):
    """Just above the critical friction too, where pyramids in the cones hold no forces."""
    rng = np.random.default_rng(40)
    for _ in range(15):
        positions, normals, friction, wrench = closed_just_so(rng)
        forces = contact_forces(positions, normals, friction, wrench, objective=objective)
        along, across = normal_and_tangential(forces, normals)
        assert (across <= (1.0 + 1e-6) * friction * along + 1e-6 * np.abs(forces).max()).all()
        off = np.abs(grasp_map(positions) @ forces.ravel() + wrench).max()
        assert off <= 1e-6 * np.abs(wrench).max()


def test_where_nothing_balances_closest_forces_do_their_best():
    """They push against the load with all they have, and balance what can be balanced."""
    options = {"normal_force": (0.0, 2.0), "objective": "closest"}
    for size in (0.1, 100.0):
        load = np.array([size, 0.0, 0.0, 0.0, 0.0, 0.0])
        forces = contact_forces(TETRA_CENTERS, TETRA_NORMALS, 0.5, load, **options)
        along, across = normal_and_tangential(forces, TETRA_NORMALS)
        assert (along >= 0.0).all()
        assert (along <= 2.0 * (1.0 + 1e-9)).all()
        assert (across <= 0.5 * along + 1e-9).all()
        left = load[:3] + forces.sum(axis=0)
        assert 0.0 <= left[0] < size
        assert bool(left[0] < 0.01) is (size < 1.0)


@pytest.mark.timeout(60)
@pytest.mark.parametrize("objective", ["least_norm", "least_friction"])
@pytest.mark.parametrize("part", [0, 5])
def test_loads_far_beyond_the_limits_are_refused_without_a_search(objective, part):
    """A solver was busy for seven seconds with each of these."""
    loads = np.zeros((20, 6))
    loads[:, part] = 1.0
    with pytest.raises(gc.NoForcesError, match="wrench 0, counting from 0"):
        gc.contact_forces(
            TETRA_CENTERS, TETRA_NORMALS, 0.5, loads, normal_force=(0.0, 1e-9), objective=objective
        )
