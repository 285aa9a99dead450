"""Blocks of quadruples, and what bounds them before their cones are chosen."""

import math
from itertools import combinations

import numpy as np
import pytest

from grasp_core.cones.spanning import span_sines
from grasp_core.cones.tilting import tilted_cones, widest_half_angles
from grasp_core.objects.face_pieces import face_shapes
from grasp_core.planning import quadruples as tables
from scenes.example_objects import example_object

NONE = np.empty((0, 4), dtype=np.int64)
BODIES = ("random-14-1", "chamfered-box", "l-bracket", "double-wedge-bar")


def planned(body):
    return tables.PlannedCones(body, face_shapes(body), math.atan(0.5), tilted=True)


@pytest.mark.parametrize("name", ["random-30-1", "l-bracket"])
def test_blocks_hold_every_quadruple_with_room_once(name):
    cones = planned(example_object(name))
    roomy = np.flatnonzero(cones.rooms > 0.0)
    blocks = tables.all_blocks(cones, len(cones.rooms), NONE)
    rooms, make = blocks.rooms, blocks.make
    made = [make(place).faces for place in range(len(rooms))]
    assert all(len(each) <= tables.LARGEST_BLOCK for each in made)
    listed = np.concatenate(made)
    assert len(listed) == math.comb(len(roomy), 4)
    assert {tuple(each) for each in listed.tolist()} == set(combinations(roomy.tolist(), 4))


def test_no_tilted_cones_are_wider_than_what_bounds_them():
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(3000, 4, 3))
    normals[:1000, :, 2] *= 0.1  # nearly in a plane
    normals[1000:1100, 1] = -normals[1000:1100, 0]
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    thetas = np.repeat(rng.uniform(0.05, 0.7, size=(3000, 1)), 4, axis=1)
    thetas[:500] *= rng.uniform(0.3, 1.0, size=(500, 4))
    sines = span_sines(normals)
    quick = widest_half_angles(normals, thetas, sines)
    found = tilted_cones(normals, thetas).half_angles
    usable = found > tables.LEAST_SPAN_ANGLE
    assert (found[usable] <= quick[usable]).all()
    assert min(usable.sum(), (quick < tables.LEAST_SPAN_ANGLE).sum()) >= 500


def test_the_widest_half_angle_is_that_of_the_definition():
    """Least over all directions m, here many, of the largest angle(n_i, m) - 90 deg + theta."""
    rng = np.random.default_rng(1)
    m = rng.normal(size=(50_000, 3))
    m /= np.linalg.norm(m, axis=1, keepdims=True)
    apart = math.sqrt(30.0 / len(m))  # hardly a place is farther from all of them
    normals = rng.normal(size=(160, 4, 3)) + np.array([0.0, 0.0, 0.8])
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    thetas, sines = np.full((160, 4), 1.2), span_sines(normals)
    found = 2.0 * widest_half_angles(normals, thetas, sines) - 1.2
    sampled = np.array([np.arccos(n @ m.T).max(axis=0).min() for n in normals]) - 0.5 * math.pi
    assert (sines <= 0.0).sum() >= 40
    assert (sines > 0.0).sum() >= 10
    assert (found <= sampled + 1e-5).all()
    assert (found >= sampled - apart).all()


@pytest.mark.parametrize("name", BODIES)
def test_limits_before_cones_are_chosen_bound_those_after(name):
    body = example_object(name)
    cones, tested = planned(body), 0
    wide = tables.all_blocks(cones, len(body.faces), NONE).make(0)
    limits = cones.limits(wide.faces, wide.widest)
    coned = wide.coned(slice(None))
    usable = coned.half_angles > tables.LEAST_SPAN_ANGLE
    assert (coned.half_angles[usable] <= wide.widest[np.nonzero(usable)[0]]).all()
    for kind in range(2):
        held = usable[:, kind]
        assert (coned.limits[held, kind] <= limits[held] * (1.0 + 1e-9)).all()
        tested += held.sum()
    assert tested >= 30
