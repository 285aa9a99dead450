"""Contacts, faces and grasps whose answers are known in closed form, or to all digits."""

import math
from collections import Counter
from functools import partial
from itertools import combinations, product

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.closure.lines import plucker_vectors
from grasp_core.cones.pyramids import inscribed_facets
from grasp_core.families import concurrent as concurrent_grasps
from grasp_core.families.concurrent import place_concurrent
from grasp_core.families.pencil import CELL_A, place_pencil
from grasp_core.families.placements import NoPlacement, Placement
from grasp_core.geometry.polygons import edge_rows, plane_frame
from grasp_core.objects.booleans import hull
from grasp_core.objects.face_pieces import FacePiece, unit_pieces
from grasp_core.values import ForceCone
from scenes.example_objects import example_object
from tests.grasp_core.quadruples import tilted_side_cones
from tests.judges import TETRA_CENTERS, TETRA_NORMALS, random_contacts, random_rotation

TOLERANCE = 1e-7
"""Ten times the residual at which a program's answer is accepted, in object radii; a critical
friction is bracketed ten times as narrowly."""
GOLDEN = (1.0 + math.sqrt(5.0)) / 2.0
V4 = [np.diag(signs) for signs in ([1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1])]
"""The rotations of a tetrahedron that move every face."""


def units(vectors):
    vectors = np.asarray(vectors, dtype=float)
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def all_signs(count):
    return np.array(list(product((1.0, -1.0), repeat=count)))


def in_three_planes(x, y):
    """(0, +-x, +-y) and its cyclic images: twelve vectors."""
    flat = np.column_stack([np.zeros(4), all_signs(2) * (x, y)])
    return np.vstack([np.roll(flat, turn, axis=1) for turn in range(3)])


SOLIDS = {
    "tetrahedron": TETRA_NORMALS,
    "cube": np.vstack([np.eye(3), -np.eye(3)]),
    "octahedron": units(all_signs(3)),
    "dodecahedron": units(in_three_planes(1.0, GOLDEN)),
    "icosahedron": units(np.vstack([all_signs(3), in_three_planes(1.0 / GOLDEN, GOLDEN)])),
}
"""Normals of the faces of the regular solids; the centres of the faces are opposite to them."""


def quadruples(rows):
    return [rows[list(chosen)] for chosen in combinations(range(len(rows)), 4)]


# Positive spanning.


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("tetrahedron", {19.4712: 1}),
        ("cube", {0.0: 15}),
        ("octahedron", {19.4712: 2, 0.0: 68}),
        ("dodecahedron", {10.8123: 30, 0.0: 465}),
        ("icosahedron", {19.4712: 10, 10.8123: 80, 5.4547: 330, 0.0: 4425}),
    ],
)
def test_span_angles_of_all_quadruples_of_a_regular_solid(name, expected):
    angles = [math.degrees(gc.span_angle(normals)) for normals in quadruples(SOLIDS[name])]
    assert Counter(round(angle, 4) for angle in angles) == expected


def test_the_dodecahedron_spans_at_ten_degrees_but_not_at_eleven():
    angles = np.array([gc.span_angle(normals) for normals in quadruples(SOLIDS["dodecahedron"])])
    assert (angles > math.radians(10.0)).sum() == 30
    assert not (angles > math.radians(11.0)).any()
    assert math.tan(angles.max()) == pytest.approx((3.0 - math.sqrt(5.0)) / 4.0, abs=1e-12)


def test_the_one_parameter_family_contains_the_regular_tetrahedron():
    phi = math.atan(math.sqrt(2.0))
    c, s = math.cos(phi), math.sin(phi)
    normals = [[c, s, 0], [c, -s, 0], [-c, 0, s], [-c, 0, -s]]
    assert gc.span_angle(normals) == pytest.approx(math.asin(1.0 / 3.0), abs=1e-12)


@pytest.mark.parametrize("slope", [0.1, 0.5, 1.0, 3.0, 20.0])
def test_square_pyramids_never_span(slope):
    """Two opposite sides and the base have normals in one plane."""
    sides = [[1, 0, -slope], [-1, 0, -slope], [0, 1, -slope], [0, -1, -slope]]
    normals = units([*sides, [0, 0, 1]])
    assert [gc.span_angle(chosen) for chosen in quadruples(normals)] == [0.0] * 5


@pytest.mark.parametrize("sides", [3, 4, 5, 6, 7, 8])
def test_right_prisms_never_span(sides):
    """A spanning quadruple needs both ends, and the other two are in a plane with them."""
    turns = 2.0 * np.pi * np.arange(sides) / sides
    around = np.column_stack([np.cos(turns), np.sin(turns), 0.0 * turns])
    angles = [gc.span_angle(q) for q in quadruples(np.vstack([around, [[0, 0, 1], [0, 0, -1]]]))]
    assert not any(angles)
    assert len(angles) == math.comb(sides + 2, 4)


def test_no_four_directions_span_at_more_than_those_of_the_regular_tetrahedron():
    rng, spanning, widest = np.random.default_rng(0), 0, 0.0
    for _ in range(3000):
        normals = units(rng.normal(size=(4, 3)))
        near = units(TETRA_NORMALS + 0.05 * rng.normal(size=(4, 3)))
        for angle in (gc.span_angle(normals), gc.span_angle(near)):
            assert angle <= math.asin(1.0 / 3.0) + 1e-12
            spanning += angle > 0.0
            widest = max(widest, angle)
    assert spanning >= 3300
    assert widest > math.radians(19.0)


def test_what_is_planned_with_narrow_cones_is_closed_with_wide_ones():
    tested = 0
    for name in ("dodecahedron", "random-12-1", "double-wedge-bar"):
        for grasp in gc.plan(example_object(name), 0.5, theta_deg=5.0, limit=9).grasps:
            narrow = math.tan(max(cone.half_angle for cone in grasp.force_cones))
            assert narrow <= math.tan(math.radians(5.0))
            for friction in (narrow + 1e-6, 0.1, 0.3535, 0.3536, 0.5, 2.0):
                assert gc.force_closure(grasp, friction=friction).closed
            tested += 1
    assert tested >= 25


# Critical friction and equilibrium.


def cotangent_of_cap(normals):
    """Cotangent of the angular radius of the least cap that holds unit vectors, at least zero.

    The cap is determined by two or three of them, or there is none below a half space.
    """
    middles = [a + b for a, b in combinations(normals, 2)]
    middles += [np.cross(b - a, c - a) for a, b, c in combinations(normals, 3)]
    middles = units([m for m in middles if np.linalg.norm(m) > 1e-9])
    cosine = min(max((np.vstack([middles, -middles]) @ normals.T).min(axis=1).max(), 0.0), 1.0)
    return cosine / math.sqrt(1.0 - cosine**2)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("tetrahedron", {0.0: 1}),
        ("cube", {0.0: 15}),
        ("octahedron", {0.0: 56, 0.353553: 8, 0.707107: 6}),
        ("dodecahedron", {0.0: 285, 0.190983: 60, 0.5: 120, 0.618034: 30}),
    ],
)
def test_critical_frictions_at_the_face_centres_of_a_regular_solid(name, expected):
    """All equal the cotangent of the least cap around the normals.

    Where that is zero the margin may grow with the square of the friction only, as 0.007 mu^2: at
    1e-5 it is seventy times the slack of the proofs. What is reported is then zero to four digits.
    """
    seen = Counter()
    for normals in quadruples(SOLIDS[name]):
        critical, cap = gc.critical_friction(-normals, normals), cotangent_of_cap(normals)
        if cap < 1e-9:
            assert gc.force_closure(-normals, normals, 1e-5).closed
            assert critical < 5e-5
        else:
            assert critical == pytest.approx(cap, rel=TOLERANCE)
        seen[round(cap, 6)] += 1
    assert seen == expected


def test_a_critical_friction_of_zero_is_bracketed_to_a_few_millionths():
    """Closure is proved at 2e-6 for each of these contacts."""
    zeros = [n for n in quadruples(SOLIDS["dodecahedron"]) if cotangent_of_cap(n) < 1e-9]
    assert all(gc.force_closure(-normals, normals, 2e-6).closed for normals in zeros)
    assert max(gc.critical_friction(-normals, normals) for normals in zeros) < 4e-6


def test_the_faces_that_an_octahedron_needs_friction_on():
    """A face with its three neighbours, and the four faces around a vertex."""
    normals = all_signs(3)
    for chosen in quadruples(normals):
        critical = gc.critical_friction(-units(chosen), units(chosen))
        if any((chosen @ face == 1.0).sum() == 3 for face in chosen):
            assert critical == pytest.approx(1.0 / math.sqrt(8.0), rel=TOLERANCE)
        elif (np.abs(chosen.sum(axis=0)) == 4.0).any():
            assert critical == pytest.approx(1.0 / math.sqrt(2.0), rel=TOLERANCE)
        else:
            assert critical < 1e-5


def small_piece(center, normal):
    """A triangle of a ten-thousandth around a contact."""
    turns = 2.0 * np.pi * np.arange(3) / 3.0
    corners = 1e-4 * np.column_stack([np.cos(turns), np.sin(turns)])
    E, b = edge_rows(corners)
    return FacePiece(0, normal, center, plane_frame(normal), corners, E, b, b.min())


T1, T2 = np.array([1.0, -1, 0]) / math.sqrt(2.0), np.array([1.0, 1, -2]) / math.sqrt(6.0)


@pytest.mark.parametrize(
    ("shift", "family"),
    [
        (0.1 * T1, "regulus"),
        (0.08 * T1 - 0.12 * T2, "regulus"),
        (0.05 * T1 + 0.15 * T2, "regulus"),
        (0.15 * T2, "pencil"),
        (-0.18 * T2, "pencil"),
    ],
)
def test_equal_displacements_leave_no_focus_unless_there_is_enough_friction(shift, family):
    """The lines along the normals are dependent, and skew unless the shift is towards an edge: then
    two of them are in either of two planes.

    By symmetry the best focus is the centre of the tetrahedron, which each contact sees at |shift|
    over the inradius. Pyramids of sixteen sides may ask for 1.9 % more, the triangles for 0.1 %
    less.
    """
    positions = np.array([R @ (TETRA_CENTERS[0] + shift) for R in V4])
    normals = np.array([R @ TETRA_NORMALS[0] for R in V4])
    assert np.linalg.svd(plucker_vectors(positions, normals), compute_uv=False)[3] < 1e-12
    assert gc.classify_lines(positions, normals) == family
    assert gc.force_closure(positions, normals, 1e-3).closed
    pieces = [small_piece(*contact) for contact in zip(positions, normals, strict=True)]
    needed = math.sqrt(3.0) * np.linalg.norm(shift)
    for share, kind in ((0.5, NoPlacement), (0.99, NoPlacement), (1.025, Placement)):
        cones = [ForceCone(normal, math.atan(share * needed)) for normal in normals]
        assert isinstance(place_concurrent(pieces, cones, least=0.0), kind)


def wedge_contacts(length, l, m, s):  # noqa: E741 - the oracle's letters
    """Two contacts on either end of a double-wedge bar."""
    x = length + 1.0 - s
    positions = np.array([[-x, s, l], [-x, -s, -l], [x, m, s], [x, -m, -s]])
    return positions, units([[1, -1, 0], [1, 1, 0], [-1, 0, -1], [-1, 0, 1]])


@pytest.mark.parametrize("s", [0.3, 0.5])
@pytest.mark.parametrize("l", [0.0, 0.1, 0.3])
def test_the_length_of_a_double_wedge_bar_does_not_matter(l, s):  # noqa: E741 - as above
    """For m = -l the critical friction is |D| / sqrt(2 + D^2), D = (l - m) / 2 s; for other m it
    is no more than that.
    """
    for m in (-l, 0.2 - l, l):
        D = (l - m) / (2.0 * s)
        bound = abs(D) / math.sqrt(2.0 + D * D)
        found = [gc.critical_friction(*wedge_contacts(x, l, m, s)) for x in (0.5, 1.0, 3.0, 8.0)]
        assert found == pytest.approx(found[:1] * 4, rel=TOLERANCE, abs=4e-6)
        assert max(found) <= bound + 4e-6
        if m == -l:
            assert found[0] == pytest.approx(bound, rel=TOLERANCE, abs=4e-6)


@pytest.mark.parametrize(("c", "h"), [(0.25, 0.5), (0.3, 0.7), (0.2, 0.7), (0.3, 0.3), (0.2, 0.3)])
def test_a_square_with_friction_below_only_needs_c_over_h(c, h):
    """Contacts of a planar problem, below, on the right and above, each drawn twice along z.

    Forces in the plane may be shared by the two copies, and the forces of any equilibrium,
    projected into the plane, are one there; so both problems are closed together.
    """
    flat, up = np.array([[0.0, -0.5, 0.0], [0.5, h - 0.5, 0.0], [c, 0.5, 0.0]]), np.eye(3)[2]
    positions = np.vstack([flat - up, flat + up])
    normals = np.tile([[0.0, 1, 0], [-1, 0, 0], [0, -1, 0]], (2, 1))
    for step in (-1e-3, 1e-3):
        certificate = gc.force_closure(positions, normals, [c / h + step, 0.0, 0.0] * 2)
        assert certificate.closed == (step > 0.0)
        assert certificate.verify()


def test_seven_frictionless_contacts_hold_a_cube_when_one_is_moved():
    below, above = [1.0, -1, -1], [-1.0, 1, 1]
    positions = np.array([below] * 3 + [above] * 3 + [[1, 1, 1]])
    normals = np.array(
        [[0.0, 0, 1], [-1, 0, 0], [0, 1, 0], [0, 0, -1], [1, 0, 0], [0, -1, 0], [0, 0, -1]]
    )
    for first, closed in ((below, False), ([1.0, 0, -1], True)):
        positions[0] = first
        certificate = gc.force_closure(positions, normals, 0.0)
        assert certificate.closed is closed
        assert certificate.verify()


# Constructions.


@pytest.mark.parametrize(
    ("theta_deg", "radius"), [(5.0, 0.0466666), (10.0, 0.0940532), (15.0, 0.1429247)]
)
def test_concurrent_discs_of_a_tetrahedron_with_pyramids_of_eight_sides(
    monkeypatch, theta_deg, radius
):
    """r = rho0 tan(theta) cos(pi / 8), with rho0 = 1 / sqrt(3) for vertices at sqrt(3)."""
    monkeypatch.setattr(concurrent_grasps, "inscribed_facets", partial(inscribed_facets, sides=8))
    pieces = unit_pieces(example_object("tetrahedron"))
    cones = [ForceCone(piece.normal, math.radians(theta_deg)) for piece in pieces]
    placed = place_concurrent(pieces, cones, least=1e-4)
    assert isinstance(placed, Placement)
    assert math.sqrt(3.0) * placed.radii == pytest.approx(radius, abs=2e-7)
    assert placed.foci == pytest.approx(0.0, abs=TOLERANCE)


def bar(length):
    """A double-wedge bar with ends at +-(length + 1), and the four pieces of its ends."""
    tips = [[-length - 1.0, 0, s] for s in (-1, 1)] + [[length + 1.0, s, 0] for s in (-1, 1)]
    solid = hull(np.vstack([tips, all_signs(3) * (length, 1.0, 1.0)]))
    body = gc.Polyhedron.from_mesh(solid.vertices, solid.triangles)
    ends = [p for s in (-1, 1) for p in unit_pieces(body) if s * p.normal[0] < -0.5]
    return body, ends


def half_angle_cones(pieces, theta_deg):
    return [ForceCone(piece.normal, math.radians(theta_deg)) for piece in pieces]


def test_a_double_wedge_bar_has_rectangles_and_pentagons_that_span_in_nine_ways():
    body, ends = bar(3.0)
    corners = Counter(len(face.pieces[0]) for face in body.faces)
    assert corners == {4: 4, 5: 4}
    angles = np.degrees([gc.span_angle(normals) for normals in quadruples(body.normals)])
    wide = sorted(angles[angles > 10.0])
    assert wide == pytest.approx([12.4589] * 8 + [18.434949], abs=5e-5)
    assert (angles > 15.0).sum() == 1
    assert math.degrees(gc.span_angle([p.normal for p in ends])) == pytest.approx(wide[-1])


@pytest.mark.parametrize("theta_deg", [5.0, 10.0, 15.0])
@pytest.mark.parametrize("length", [1.0, 3.0, 7.0])
def test_pencils_on_the_ends_of_a_bar_do_not_depend_on_its_length(theta_deg, length):
    """r = sqrt(2) t / (1 + t), t = tan(theta / 2), from length (1 - t) / (1 + t) on."""
    body, ends = bar(length)
    t = math.tan(math.radians(theta_deg) / 2.0)
    assert length > (1.0 - t) / (1.0 + t)
    cones = half_angle_cones(ends, theta_deg)
    placed = place_pencil(ends, cones, least=1e-3, least_gap=1e-3, cells=(CELL_A,))
    assert isinstance(placed, Placement)
    expected = math.sqrt(2.0) * t / (1.0 + t)
    assert body.radius * placed.merit == pytest.approx(expected, abs=body.radius * TOLERANCE)


def test_a_focus_serves_both_ends_of_a_bar_only_up_to_a_known_length():
    """2 / (1 - q) - 1, where q is tan(10 deg) for cones; pyramids of sixteen sides stand between
    cones and cos(pi / 16) of them: 1.4182 to 1.4281.
    """
    q = math.tan(math.radians(10.0))
    longest = [2.0 / (1.0 - share * q) - 1.0 for share in (math.cos(math.pi / 16.0), 1.0)]
    assert longest == pytest.approx([1.4182, 1.4281], abs=5e-5)
    for length, kind in ((longest[0] - 1e-3, Placement), (longest[1] + 1e-3, NoPlacement)):
        _, ends = bar(length)
        assert isinstance(place_concurrent(ends, half_angle_cones(ends, 10.0), least=0.0), kind)


def test_margins_of_the_upper_faces_of_an_octahedron():
    """The corners of the faces, then their centres."""
    signs = np.column_stack([all_signs(2), np.ones(4)])
    corners = np.array([np.diag(row) for row in signs])
    at_corners = corners.reshape(-1, 3), np.repeat(-units(signs), 3, axis=0)
    at_centers = corners.mean(axis=1), -units(signs)
    for friction, by_corners, by_centers in ((0.70, -0.00059, -0.00178), (0.72, 0.00107, 0.00322)):
        patch = gc.force_closure(*at_corners, friction)
        assert patch.margin == pytest.approx(by_corners, abs=5e-6)
        assert gc.force_closure(*at_centers, friction).margin == pytest.approx(by_centers, abs=5e-6)


@pytest.mark.parametrize(
    ("friction", "tilt_deg", "half_angle_deg", "radius"),
    [
        (0.5, 14.036, 12.529, 0.2284),
        (0.3, 8.531, 8.168, 0.1445),
        (0.8, 21.801, 16.858, 0.3273),
        (1.0, 26.565, 18.435, 0.3765),
    ],
)
def test_tilted_cones_hold_a_cube_by_its_four_sides(friction, tilt_deg, half_angle_deg, radius):
    """The best tilt leaves the half-angle theta - tilt at which the axes just span. The radii are
    of pyramids of 32 sides, which reach 0.5 % less than cones and 1.5 % farther than those of 16.
    """
    solid = hull(all_signs(3))
    body = gc.Polyhedron.from_mesh(solid.vertices, solid.triangles)
    sides = [piece for piece in unit_pieces(body) if abs(piece.normal[2]) < 0.5]
    cones = tilted_side_cones(sides, math.radians(tilt_deg), math.radians(half_angle_deg))
    spans = math.degrees(gc.span_angle([cone.axis for cone in cones]))
    assert spans == pytest.approx(half_angle_deg, abs=1e-3)
    assert math.degrees(math.atan(friction)) - tilt_deg == pytest.approx(spans, abs=1e-3)
    placed = place_concurrent(sides, cones, least=1e-4)
    assert isinstance(placed, Placement)
    assert 0.983 * radius < body.radius * placed.merit < 1.005 * radius


# Forces and invariance.


@pytest.mark.parametrize(("count", "largest"), [(5, 0.49108896), (6, 0.38630774)])
def test_the_largest_normal_force_under_a_weight_on_a_paraboloid(count, largest):
    """Contacts on z = x^2 + y^2 around (0.3, 0); a known problem of convex optimisation."""
    turns = 2.0 * np.pi * np.arange(1, count + 1) / count
    x, y = 0.3 + np.cos(turns), np.sin(turns)
    positions = np.column_stack([x, y, x * x + y * y])
    normals = units(np.column_stack([-2.0 * x, -2.0 * y, np.ones(count)]))
    weight = [0.0, 0.0, -1.0, 0.0, 0.0, 0.0]
    resisted = gc.max_resisted_wrench(positions, normals, 0.3, weight, max_normal_force=1.0)
    assert 1.0 / resisted == pytest.approx(largest, abs=5e-9)


def test_motions_sizes_orders_and_mirrors_leave_thresholds_alone():
    rng, tested = np.random.default_rng(1), 0
    for _ in range(40):
        positions, normals = random_contacts(rng)
        turn, size, order = random_rotation(rng), 10.0 ** rng.uniform(-3, 3), rng.permutation(4)
        turn = turn * rng.choice([1.0, -1.0])
        points = (size * positions @ turn.T + size * rng.normal(size=3))[order]
        directions = units(normals @ turn.T)[order]
        assert gc.span_angle(directions) == pytest.approx(gc.span_angle(normals), abs=1e-12)
        here, there = (
            gc.critical_friction(positions, normals),
            gc.critical_friction(points, directions),
        )
        if 1e-3 < here < 10.0:
            assert there == pytest.approx(here, rel=TOLERANCE)
            for friction in (0.999 * here, 1.001 * here):
                closed = gc.force_closure(points, directions, friction).closed
                assert closed == (friction > here)
            tested += 1
    assert tested >= 25
