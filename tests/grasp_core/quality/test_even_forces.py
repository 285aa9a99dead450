"""Even forces against their definition: balance, cones, and that no finger could push more."""

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.closure.contacts import normal_and_tangential
from grasp_core.quality.contact_forces import even_forces
from tests.grasp_core.quality.loads import closed_just_so

CUBE = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])


def pushes(forces, normals):
    return np.einsum("ki,ki->k", forces, normals)


def check(positions, normals, friction, forces):
    """Balanced, in the cones, and scaled to a largest push of one."""
    size = float(np.abs(positions - positions.mean(axis=0)).max())
    along, across = normal_and_tangential(forces, normals)
    assert (across <= friction * along * (1.0 + 1e-6) + 1e-9).all()
    assert along.max() == pytest.approx(1.0)
    assert np.abs(forces.sum(axis=0)).max() < 1e-8
    assert np.abs(np.cross(positions, forces).sum(axis=0)).max() < 1e-8 * (
        size + float(np.abs(positions).max())
    )


def test_opposite_pairs_all_push_alike():
    forces = even_forces(CUBE, -CUBE, 0.3)
    check(CUBE, -CUBE, 0.3, forces)
    assert pushes(forces, -CUBE) == pytest.approx(1.0)


def test_a_slanted_push_is_shared_as_statics_says():
    """Two fingers push up at x = -1 and 1, one down at x = 1/2, at height 1: they share it 1 to 3.

    Friction of 0.1 at the top and the bottom is a couple of 0.1, which moves 0.05 from one to the
    other.
    """
    positions = np.array([[-1.0, 0, 0], [1, 0, 0], [0.5, 0, 1]])
    normals = np.array([[0, 0, 1.0], [0, 0, 1], [0, 0, -1]])
    forces = even_forces(positions, normals, 0.1)
    check(positions, normals, 0.1, forces)
    assert pushes(forces, normals) == pytest.approx([0.3, 0.7, 1.0])


def test_fingers_that_cannot_all_push_are_told():
    with pytest.raises(gc.NoForcesError, match="every finger pushes"):
        even_forces(CUBE, np.tile([0.0, 0.0, 1.0], (4, 1)), 0.5)


def test_no_finger_pushes_less_than_with_the_deepest_forces():
    """Those are balanced and in the cones as well, so their least push cannot be larger."""
    rng = np.random.default_rng(0)
    for _ in range(15):
        positions, normals, friction, _ = closed_just_so(rng)
        forces = even_forces(positions, normals, friction)
        check(positions, normals, friction, forces)
        deepest = pushes(gc.force_closure(positions, normals, friction).forces, normals)
        assert pushes(forces, normals).min() >= deepest.min() / deepest.max() - 1e-7
