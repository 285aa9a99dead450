import math

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.cones.pyramids import PYRAMID_SIDES, pyramid_facets
from grasp_core.families.placing import CONSTRUCTIONS
from grasp_core.objects.face_pieces import unit_pieces
from grasp_core.values import ForceCone
from scenes.example_objects import example_object
from tests.grasp_core.families.disc_borders import on_borders
from tests.grasp_core.quadruples import spanning_quadruples
from tests.grasp_core.regular_solids import TOLERANCE


def placements(name, theta, limit):
    """Placements on the spanning quadruples of a convex object, at most `limit`."""
    body = example_object(name)
    pieces = unit_pieces(body)
    found = spanning_quadruples(body.normals, theta)
    for faces in found[:limit]:
        quad = [pieces[face] for face in faces]
        cones = [ForceCone(piece.normal, theta) for piece in quad]
        yield quad, CONSTRUCTIONS["concurrent"].place(quad, cones, 1e-4)


@pytest.mark.parametrize("theta_deg", [5.0, 10.0, 15.0])
def test_the_tetrahedron_has_four_equal_discs_about_its_centres(theta_deg):
    """r = rho0 tan(theta) cos(pi / 16), with rho0 = 1/3 of the radius."""
    theta = math.radians(theta_deg)
    (quad, placed), = placements("tetrahedron", theta, 1)  # fmt: skip
    expected = math.tan(theta) * math.cos(math.pi / 16) / 3.0
    assert placed is not None
    np.testing.assert_allclose(placed.radii, expected, atol=TOLERANCE)
    np.testing.assert_allclose(placed.foci[0], 0.0, atol=TOLERANCE)
    centers = [-piece.normal / 3.0 for piece in quad]
    np.testing.assert_allclose(placed.positions, centers, atol=TOLERANCE)


def test_discs_lie_in_their_faces_and_contacts_anywhere_in_them_are_in_force_closure():
    """The independent regions of section 3.1, by the exact circular cones at a slightly larger
    friction, since contacts on the borders may use the very edge of the force cones.
    """
    rng = np.random.default_rng(0)
    theta, tested = math.radians(9.0), 0
    for name in ("random-20-7", "icosahedron", "random-30-2"):
        for quad, placed in placements(name, theta, 60):
            if placed is None:
                continue
            for piece, center, radius in zip(quad, placed.positions, placed.radii, strict=True):
                flat = piece.frame.T @ (center - piece.origin)
                assert (piece.E @ flat + radius <= piece.b + TOLERANCE).all()
            for _ in range(4):
                turns = rng.uniform(0, 2 * np.pi, 4)
                reach = placed.radii * np.array(rng.choice([1.0, 1.0, 0.5], 4))
                points = on_borders(quad, placed.positions, reach, turns)
                normals = [piece.normal for piece in quad]
                assert gc.force_closure(points, normals, math.tan(theta) + 1e-5).closed
                tested += 1
    assert tested >= 200


def test_facets_lie_inside_the_circular_cone():
    cone = ForceCone(np.array([0.0, 0.6, 0.8]), math.radians(20.0))
    G = pyramid_facets(cone.axis, cone.half_angle, np.array([1.0, 0.2, 0.1]), PYRAMID_SIDES)
    assert (G @ cone.axis > 0).all()
    for one, two in zip(G, np.roll(G, -1, axis=0), strict=True):
        edge = np.cross(one, two)
        edge *= np.sign(edge @ cone.axis) / np.linalg.norm(edge)
        assert math.acos(edge @ cone.axis) == pytest.approx(cone.half_angle, abs=1e-12)
        assert (G @ edge >= -1e-12).all()
