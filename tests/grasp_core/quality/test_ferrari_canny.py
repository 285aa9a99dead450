import numpy as np
import pytest
from scipy.spatial import ConvexHull

import grasp_core as gc
from grasp_core.quality import ferrari_canny as module
from grasp_core.quality.wrench_limits import WrenchBody, limit_of
from tests.judges import TETRA_CENTERS, TETRA_NORMALS, pyramid_wrenches, random_contacts
from tests.tampering.changes import forged
from tests.tampering.exact_closure import unit_arms

TETRA = TETRA_CENTERS, TETRA_NORMALS, 0.5
ALL_NORMS = ("l1", "linf")


def qhull_distance(points):
    """Least distance of zero from a facet plane of the hull, negative if outside."""
    return -ConvexHull(points, qhull_options="QJ Pp").equations[:, -1].max()


def test_the_centers_of_a_tetrahedron():
    """Values bracketed by repeated qhull with exact support points."""
    found = gc.ferrari_canny(TETRA_CENTERS, TETRA_NORMALS, 0.3, torque_scale=1.0)
    assert found.lower <= 0.124355
    assert found.upper >= 0.124352
    assert found.upper - found.lower <= module.QUALITY_GAP * found.upper
    assert found.verify()


def test_qhull_on_inner_and_outer_pyramids_lies_on_either_side():
    rng = np.random.default_rng(21)
    closed = 0
    while closed < 6:
        positions, normals = random_contacts(rng)
        center, size = positions.mean(axis=0), unit_arms(positions)[1]
        found = gc.ferrari_canny(positions, normals, 0.6, center=center, torque_scale=size)
        if found.lower <= 0.0:
            continue
        inner, outer = (
            qhull_distance(pyramid_wrenches(positions, normals, 0.6, 12, outer=outer))
            for outer in (False, True)
        )
        assert inner <= found.upper + 1e-9
        assert outer >= found.lower - 1e-9
        closed += 1


def test_without_friction_the_hull_of_the_normals_is_exact():
    rng = np.random.default_rng(3)
    closed = 0
    while closed < 10:
        positions, normals = random_contacts(rng, 14, spread=1.5)
        exact = qhull_distance(np.hstack([normals, np.cross(positions, normals)]))
        found = gc.ferrari_canny(positions, normals, 0.0, torque_scale=1.0)
        assert (found.lower > 0.0) == (exact > 0.0)
        if exact > 0.0:
            assert found.lower == pytest.approx(exact, rel=1e-9)
            closed += 1


@pytest.mark.parametrize("norm", ALL_NORMS)
def test_sampled_supports_are_never_below_the_lower_bound(norm):
    rng = np.random.default_rng(4)
    tested = 0
    while tested < 8:
        positions, normals = random_contacts(rng)
        found = gc.ferrari_canny(positions, normals, 0.7, torque_scale=0.5, norm=norm)
        if found.lower <= 0.0:
            continue
        y = rng.normal(size=(1000, 6))
        y = np.vstack([y, found.direction + 0.1 * rng.normal(size=(1000, 6))])
        y /= np.linalg.norm(y, axis=1, keepdims=True)
        velocities = y[:, None, :3] + np.cross(y[:, None, 3:], positions / 0.5)
        along = np.einsum("ski,ki->sk", velocities, normals)
        across = np.linalg.norm(velocities - along[..., None] * normals, axis=2)
        each = along + 0.7 * across
        supports = each.max(axis=1) if norm == "l1" else np.maximum(each, 0.0).sum(axis=1)
        assert supports.min() >= found.lower
        tested += 1


def test_bounded_forces_resist_the_weakest_wrench_exactly_so_far():
    """Along the direction found, the largest resisted wrench is the quality."""
    rng = np.random.default_rng(5)
    tested = 0
    while tested < 10:
        positions, normals = random_contacts(rng)
        found = gc.ferrari_canny(positions, normals, 0.7, torque_scale=1.0, norm="linf")
        if found.lower > 0.0:
            body = WrenchBody(positions, normals, np.full(4, 0.7), 1.0)
            limit = limit_of(body, -found.direction).limit
            assert found.lower * (1 - 1e-9) <= limit <= found.upper * (1 + 1e-6)
            tested += 1


@pytest.mark.parametrize("norm", ALL_NORMS)
def test_bounds_are_proved_narrow_and_positive_exactly_with_closure(norm):
    rng = np.random.default_rng(6)
    seen = {True: 0, False: 0}
    for _ in range(30):
        positions, normals = random_contacts(rng)
        found = gc.ferrari_canny(positions, normals, 0.5, torque_scale=1.3, norm=norm)
        closed = gc.force_closure(positions, normals, 0.5).closed
        assert found.verify()
        assert (found.lower > 0.0) == closed
        assert found.lower <= found.upper
        assert found.upper - found.lower <= module.QUALITY_GAP * abs(found.upper) + 1e-9
        if not closed and norm == "l1":
            assert found.upper < 0.0
        seen[closed] += 1
    assert min(seen.values()) >= 5


def test_contacts_that_push_one_way_are_as_far_from_balance_as_they_push():
    positions = np.array([[1.0, 0, 0], [-0.5, 0.8, 0], [-0.5, -0.8, 0]])
    normals = np.tile([0.0, 0, 1], (3, 1))
    found = gc.ferrari_canny(positions, normals, 0.2, torque_scale=1.0)
    assert found.lower == pytest.approx(-1.0, abs=1e-8)
    assert found.upper == pytest.approx(-1.0, abs=1e-8)
    assert found.verify()
    resting = gc.ferrari_canny(positions, normals, 0.2, torque_scale=1.0, norm="linf")
    assert (resting.lower, resting.upper) == (0.0, pytest.approx(0.0, abs=1e-9))
    assert resting.verify()


def test_a_full_store_gives_wider_bounds_that_hold(monkeypatch):
    monkeypatch.setattr(module, "MOST_SIMPLICES", 500)
    rough = gc.ferrari_canny(TETRA_CENTERS, TETRA_NORMALS, 0.5, torque_scale=1.0)
    assert rough.lower < 0.213195
    assert rough.upper > 0.213195
    assert rough.verify()


def test_proofs_do_not_survive_tampering():
    found = gc.ferrari_canny(TETRA_CENTERS, TETRA_NORMALS, 0.5, torque_scale=1.0)
    polytope = found.polytope
    tampered = (
        forged(found, lower=found.lower * 1.001),
        forged(found, upper=found.upper * 0.999),
        forged(found, direction=-found.direction),
        forged(found, polytope=forged(polytope, corners=polytope.corners[1:])),
        forged(found, polytope=forged(polytope, forces=1.01 * polytope.forces)),
        forged(found, polytope=None),
    )
    assert found.verify()
    assert not any(each.verify() for each in tampered)
    apart = gc.ferrari_canny(TETRA_CENTERS, np.tile([0.0, 0, 1], (4, 1)), 0.5, torque_scale=1.0)
    assert apart.verify()
    assert not forged(apart, lower=0.99 * apart.lower).verify()
    assert not forged(apart, upper=1.01 * apart.upper).verify()


def test_a_ray_through_a_corner_proves_nothing():
    """A simplex beside zero, one corner on the ray: rounding would decide what is crossed."""
    ray = np.cos(np.arange(1.0, 7.0))
    unit = ray / np.linalg.norm(ray)
    rng = np.random.default_rng(8)
    wrenches = forged(gc.ferrari_canny(*TETRA, torque_scale=1.0).wrenches, G=np.eye(6))
    corners = np.array([[i for i in range(7) if i != j] for j in range(7)])
    for _ in range(50):
        points = np.vstack([ray, ray + 0.3 * rng.normal(size=(6, 6))])
        polytope = module.InnerPolytope(points, corners, np.tile(unit, (7, 1)))
        assert polytope.proved_radius(wrenches) == -np.inf
