"""Bounds on discs from corners: compiled, and beside what programs reach."""

import math

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.cones.spanning import span_sines
from grasp_core.families.disc_bounds import corners_of, disc_limits
from grasp_core.families.placements import LEAST_RADIUS, Attempts
from grasp_core.families.placing import CONSTRUCTIONS, Construction, Settling
from grasp_core.objects.face_pieces import face_shapes
from grasp_core.planning import quadruples as planned
from grasp_core.solvers.lp import RESIDUAL
from grasp_core.values import ForceCone
from scenes.example_objects import example_object
from tests.grasp_core.curved import curved_body
from tests.grasp_core.families import reference_programs as programs
from tests.grasp_core.quadruples import spanning_quadruples

FAMILIES = ("concurrent", "pencil")
BODIES = ("random-14-1", "chamfered-box", "double-wedge-bar")


def quadruples(body, seed=0):
    """Faces, axes beside their normals, and half-angles at which these span."""
    rng = np.random.default_rng(seed)
    faces = spanning_quadruples(body.normals, 0.01)
    axes = body.normals[faces] + 0.03 * rng.normal(size=(len(faces), 4, 3))
    axes /= np.linalg.norm(axes, axis=-1, keepdims=True)
    sines = span_sines(axes)
    spans = sines > 0.01
    half_angles = 0.999 * np.minimum(np.arcsin(sines[spans]), math.radians(20.0))
    return faces[spans], axes[spans], half_angles


def limits_on(body, *quads):
    return disc_limits(corners_of(body), body.normals, *quads)


def bounds_on(shapes, construction, attempts, least):
    """Bounds of a construction on the hulls of faces."""
    return construction.bounds(Settling(construction, shapes).table, attempts, least)


@pytest.mark.parametrize("name", BODIES)
def test_no_program_reaches_beyond_its_limit(name):
    body = example_object(name)
    faces, axes, half_angles = quadruples(body, seed=1)
    limits, shapes, held = limits_on(body, faces, axes, half_angles), face_shapes(body), 0
    for family in FAMILIES:
        construction = CONSTRUCTIONS[family]
        for order, limit in zip(construction.orders, limits[:, construction.limits].T, strict=True):
            attempts = Attempts(faces[:, order], axes[:, order], half_angles)
            found = bounds_on(shapes, construction, attempts, LEAST_RADIUS)
            larger = found > LEAST_RADIUS + 1e-6
            assert (found[larger] <= limit[larger] + 1e-7).all()
            held += int(larger.sum())
    assert held >= 12


OBJECTS = {
    "random": lambda: example_object("random-14-1"),
    "with angles": lambda: example_object("l-bracket"),
    "curved": curved_body,
}
NONE = np.empty((0, 4), dtype=np.int64)


def attempts(body, kind, order, count=25):
    """Faces in finger order, axes and half-angles of some quadruples of a body."""
    cones = planned.PlannedCones(body, face_shapes(body), math.atan(0.5), tilted=True)
    _, make = planned.all_blocks(cones, len(body.faces), NONE)
    wide = make(0)
    found = wide.coned(slice(None))
    usable = np.flatnonzero(found.half_angles[:, kind] > planned.LEAST_SPAN_ANGLE)
    some = np.random.default_rng(0).permutation(usable)[:count]
    order = list(order)
    axes = found.axes[some, kind][:, order]
    return Attempts(found.faces[some][:, order], axes, found.half_angles[some, kind])


def by_constructions(shapes, construction, attempts):
    """Optima of the constructions' programs as plain rows, (a,)."""
    best, optimum = [], getattr(programs, construction.family)
    for faces, axes, half_angle in zip(*attempts, strict=True):
        cones = [ForceCone(axis, float(half_angle)) for axis in axes]
        pieces = [shapes[face].hull for face in faces]
        best.append(max(optimum(pieces, cones, signs) for signs in construction.patterns))
    return np.array(best) + RESIDUAL


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("name", OBJECTS)
def test_bounds_are_the_optima_of_the_programs(name, family):
    body = OBJECTS[name]()
    construction, shapes = CONSTRUCTIONS[family], face_shapes(body)
    seen = np.zeros(2, dtype=int)
    for kind in (planned.NORMAL, planned.TILTED):
        for order in construction.orders:
            some = attempts(body, kind, order)
            quick = bounds_on(shapes, construction, some, LEAST_RADIUS)
            slow = by_constructions(shapes, construction, some)
            held = slow > LEAST_RADIUS
            np.testing.assert_allclose(quick[held], slow[held], atol=2e-8)
            assert (quick[~held] <= LEAST_RADIUS + 2e-8).all()
            seen += (held.sum(), (~held).sum())
    assert seen[0] >= 12
    assert seen.sum() >= 25


def test_with_a_larger_least_radius_bounds_above_it_stay_and_others_stay_below():
    body = example_object("random-14-1")
    shapes = face_shapes(body)
    for family in FAMILIES:
        some = attempts(body, planned.TILTED, (0, 1, 2, 3), 200)
        every = bounds_on(shapes, CONSTRUCTIONS[family], some, -np.inf)
        least = float(np.median(every))
        few = bounds_on(shapes, CONSTRUCTIONS[family], some, least)
        larger = every > least + 1e-6
        assert larger.sum() >= 50
        np.testing.assert_allclose(few[larger], every[larger], atol=1e-9)
        assert (few[~larger] <= least + 2e-6).all()


@pytest.mark.slow
def test_a_plan_without_these_bounds_is_the_same(monkeypatch):
    body = example_object("tetrahedron")
    quick = gc.plan(body, 0.4, limit=12).grasps
    monkeypatch.setattr(Construction, "bounds", lambda *args: np.full(len(args[2].faces), np.inf))
    slow = gc.plan(body, 0.4, limit=12).grasps
    assert len(quick) >= 3
    assert [grasp.id for grasp in slow] == [grasp.id for grasp in quick]
    for one, other in zip(quick, slow, strict=True):
        assert one.radius == pytest.approx(other.radius, abs=1e-8 * body.radius)
