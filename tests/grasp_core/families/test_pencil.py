import math
from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.families.placements import LEAST_RADIUS
from grasp_core.families.placing import CELL_A, CELL_B, CONSTRUCTIONS
from scenes.example_objects import example_object
from tests.grasp_core.families.disc_borders import BORDER, descended_margin, extremes, least_margin
from tests.grasp_core.quadruples import paired_quadruples
from tests.grasp_core.regular_solids import TOLERANCE


def pencils(name, theta, limit=None, cells=(CELL_A, CELL_B)):
    construction = replace(CONSTRUCTIONS["pencil"], patterns=np.array(cells))
    for quad, cones in paired_quadruples(name, theta, limit):
        placed = construction.place(quad, cones, LEAST_RADIUS)
        if placed is not None:
            yield quad, cones, placed


@pytest.mark.parametrize(
    ("theta_deg", "radius"), [(5.0, 0.0252077), (10.0, 0.0505116), (15.0, 0.0760096)]
)
def test_the_tetrahedron_has_discs_of_half_the_cone_angle_in_all_pairings(theta_deg, radius):
    """r = rho0 tan(theta / 2) with rho0 = 1 / sqrt(3), for vertices at distance sqrt(3).

    With the foci pushed together, that is, as far as the least gap lets them: each is half of it
    from the middle, and 1 / sqrt(3) of that nearer to its faces. With the foci in the other order,
    but near enough to each other, discs get larger.
    """
    theta = math.radians(theta_deg)
    found = list(pencils("tetrahedron", theta, cells=(CELL_A,)))
    nearer = 0.5 * LEAST_RADIUS * math.tan(theta / 2.0)
    assert len(found) == 3
    for _, _, placed in found:
        np.testing.assert_allclose(math.sqrt(3.0) * placed.radii, radius - nearer, atol=1e-6)
    near = list(pencils("tetrahedron", theta, cells=(CELL_B,)))
    assert len(near) == 3
    for quad, _, placed in near:
        assert math.sqrt(3.0) * placed.merit > 1.1 * radius
        discs = placed.positions, placed.radii
        assert least_margin(quad, *discs, extremes(quad), math.tan(theta) + BORDER) > 0.0


def test_every_elongated_quadruple_has_one_feasible_pairing():
    """Nine quadruples span at ten degrees: the ends, and eight others with smaller discs."""
    unit = example_object("double-wedge-bar").radius / 0.02
    found = [unit * p.merit for _, _, p in pencils("double-wedge-bar", math.radians(10.0))]
    np.testing.assert_allclose(sorted(found), [0.098915] * 8 + [0.113774], atol=1e-6)


def test_lines_form_two_flat_pencils_and_discs_lie_in_their_faces():
    tested = 0
    for name in ("random-20-7", "dodecahedron", "double-wedge-bar"):
        for quad, cones, placed in pencils(name, math.radians(8.0), 60):
            assert gc.classify_lines(placed.positions, placed.forces) == "pencil"
            c = placed.foci[[0, 0, 1, 1]]
            for piece, cone, focus, at, force, radius in zip(
                quad, cones, c, placed.positions, placed.forces, placed.radii, strict=True
            ):
                flat = piece.frame.T @ (at - piece.origin)
                assert (piece.E @ flat + radius <= piece.b + TOLERANCE).all()
                assert radius >= placed.merit - TOLERANCE
                line = focus - at
                assert line @ cone.axis == pytest.approx(np.linalg.norm(line))
                assert np.linalg.norm(np.cross(line, force)) < TOLERANCE
                assert abs(piece.normal @ (at - piece.origin)) < TOLERANCE
            np.testing.assert_allclose(placed.forces.sum(axis=0), 0.0, atol=TOLERANCE)
            torque = np.cross(placed.positions, placed.forces).sum(axis=0)
            np.testing.assert_allclose(torque, 0.0, atol=TOLERANCE)
            tested += 1
    assert tested >= 200


def test_any_contacts_on_the_disc_borders_are_in_force_closure():
    rng = np.random.default_rng(2)
    theta, grasps = math.radians(10.0), 0
    for name in ("random-30-1", "icosahedron", "double-wedge-bar"):
        for quad, _, placed in list(pencils(name, theta))[:: 80 if grasps else 50]:
            choices = [*extremes(quad), *rng.uniform(0, 2 * np.pi, (8, 4))]
            discs = placed.positions, placed.radii
            assert least_margin(quad, *discs, choices, math.tan(theta) + BORDER) > 0.0
            grasps += 1
    assert grasps >= 10


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_adversarial_descent_finds_no_contacts_out_of_closure():
    theta, grasps = math.radians(10.0), 0
    for name in ("random-30-1", "random-20-7", "dodecahedron"):
        for quad, _, placed in list(pencils(name, theta))[::60]:
            discs, friction = (placed.positions, placed.radii), math.tan(theta) + BORDER
            assert descended_margin(quad, *discs, friction, step=0.6, finest=0.02) > 0.0
            grasps += 1
    assert grasps >= 12
