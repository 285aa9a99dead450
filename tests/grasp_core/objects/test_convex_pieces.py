"""The body of convex pieces has the mass properties of their union, counted cell by cell."""

from itertools import pairwise, product

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull, Delaunay
from scipy.spatial.transform import Rotation

import grasp_core as gc
from grasp_core.errors import InputError, MeshRefusal
from grasp_core.objects.convex_pieces import MOST_PIECES, convex_solids, pieced_object
from grasp_core.objects.surface import Mesh

CM = 0.01
ROUNDING = 1e-10
"""Largest relative error of sums over some hundred triangles."""


def corners_of(box):
    """The eight corners of a box between two corners."""
    return np.array(list(product(*np.transpose(box))), dtype=float)


def mesh_of(*boxes):
    """One mesh of boxes that share no vertex."""
    parts = [trimesh.creation.box(bounds=np.array(box, dtype=float)) for box in boxes]
    return Mesh(*trimesh.util.append_faces(*zip(*((p.vertices, p.faces) for p in parts),
                                                strict=True)))  # fmt: skip


def union_of(boxes):
    """Volume, centre and inertia of a union of boxes, summed over the cells of all their planes.

    A cell of sides s about c has moments V (c_i c_j + s_i^2 / 12 where i = j).
    """
    planes = [np.unique([box[end][axis] for box in boxes for end in (0, 1)]) for axis in range(3)]
    cells = [list(pairwise(each)) for each in planes]
    volume, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
    for sides in product(*cells):
        low, high = np.transpose(sides)
        middle, size = 0.5 * (low + high), high - low
        if any((box[0] <= middle).all() and (middle <= box[1]).all() for box in boxes):
            share = size.prod()
            volume, first = volume + share, first + share * middle
            second += share * (np.outer(middle, middle) + np.diag(size**2) / 12.0)
    center = first / volume
    second -= volume * np.outer(center, center)
    return volume, center, np.trace(second) * np.eye(3) - second


def assert_is(body, volume, center, inertia):
    assert body.volume == pytest.approx(volume, rel=ROUNDING)
    np.testing.assert_allclose(body.center_of_mass, center, atol=ROUNDING * body.radius)
    np.testing.assert_allclose(body.inertia, inertia, atol=ROUNDING * np.abs(inertia).max())


def test_overlapping_boxes_count_what_they_share_once():
    """16 + 16 - 4 cm^3; the point in the middle of both boxes is a centre of symmetry."""
    boxes = [((0, 0, 0), (4, 2, 2)), ((2, 1, 0), (6, 3, 2))]
    found = pieced_object([corners_of(box) for box in boxes], scale=CM)
    body, (one, two) = found.body, found.pieces
    assert body.volume == pytest.approx(28e-6, rel=ROUNDING)
    np.testing.assert_allclose(body.center_of_mass, [0.03, 0.015, 0.01], atol=1e-12)
    assert_is(body, *union_of(CM * np.array(boxes)))
    assert body.radius == pytest.approx(CM * np.sqrt(3.0**2 + 1.5**2 + 1.0**2), rel=ROUNDING)
    assert body.notes == () == body.faces
    for piece, box in zip((one, two), boxes, strict=True):
        order = np.lexsort(piece.T[::-1])
        np.testing.assert_allclose(piece[order], CM * corners_of(box), atol=1e-12)


def test_touching_boxes_are_one_box():
    boxes = [((0, 0, 0), (2, 2, 2)), ((2, 0, 0), (4, 2, 2))]
    body = pieced_object([mesh_of(box) for box in boxes], scale=CM).body
    mass = 16e-6
    inertia = mass / 12.0 * 1e-4 * np.diag([2**2 + 2**2, 4**2 + 2**2, 4**2 + 2**2])
    assert_is(body, mass, [0.02, 0.01, 0.01], inertia)
    assert body.notes == ()
    assert body.to_trimesh().area == pytest.approx(40e-4, rel=ROUNDING)  # no wall inside


def test_three_cubes_in_an_l():
    boxes = [((0, 0, 0), (1, 1, 1)), ((1, 0, 0), (2, 1, 1)), ((0, 1, 0), (1, 2, 1))]
    body = pieced_object([corners_of(box) for box in boxes], scale=CM).body
    np.testing.assert_allclose(body.center_of_mass, [CM * 5 / 6, CM * 5 / 6, CM / 2], atol=1e-12)
    assert_is(body, *union_of(CM * np.array(boxes)))
    assert body.to_trimesh().area == pytest.approx(14e-4, rel=ROUNDING)
    one_mesh = gc.Polyhedron.from_mesh(body.vertices, body.triangles)
    assert len(one_mesh.faces) == 8


def test_a_piece_inside_another_changes_nothing():
    boxes = [((0, 0, 0), (3, 3, 3)), ((1, 1, 1), (2, 2, 2))]
    found = pieced_object([corners_of(box) for box in boxes], scale=CM)
    alone = pieced_object([corners_of(boxes[0])], scale=CM).body
    assert_is(found.body, alone.volume, alone.center_of_mass, alone.inertia)
    assert len(found.body.triangles) == 12
    assert len(found.pieces) == 2


def test_a_void_that_pieces_enclose_is_no_part_of_them():
    walls = [((a, 0, 0), (a + 1, 3, 3)) for a in (0, 2)]
    walls += [((0, a, 0), (3, a + 1, 3)) for a in (0, 2)]
    walls += [((0, 0, a), (3, 3, a + 1)) for a in (0, 2)]
    body = pieced_object([corners_of(box) for box in walls], scale=CM).body
    assert body.volume == pytest.approx(26e-6, rel=ROUNDING)
    assert_is(body, *union_of(CM * np.array(walls)))
    assert body.notes == ()


@pytest.mark.parametrize("seed", range(8))
def test_random_boxes_are_as_their_cells(seed):
    rng = np.random.default_rng(seed)
    ends = np.sort(rng.integers(0, 7, (rng.integers(2, 9), 3, 2)), axis=2)
    boxes = [pair.T * CM for pair in ends if (pair[:, 0] < pair[:, 1]).all()]
    turn = Rotation.random(random_state=seed).as_matrix()
    body = pieced_object([corners_of(box) @ turn.T for box in boxes]).body
    volume, center, inertia = union_of(boxes)
    assert_is(body, volume, turn @ center, turn @ inertia @ turn.T)


def test_random_pieces_are_as_random_points_count_them():
    rng = np.random.default_rng(5)
    clouds = [rng.normal(size=(20, 3)) + 2.0 * rng.normal(size=3) for _ in range(6)]
    body = pieced_object(clouds, scale=CM).body
    low, high = np.vstack(clouds).min(axis=0), np.vstack(clouds).max(axis=0)
    points = rng.uniform(low, high, (100_000, 3))
    inside = np.any([Delaunay(cloud).find_simplex(points) >= 0 for cloud in clouds], axis=0)
    share, box = inside.mean(), np.prod(high - low)
    four_errors = 4.0 * np.sqrt(share * (1.0 - share) / len(points)) * box
    assert abs(body.volume / CM**3 - share * box) < four_errors
    mean, spread = points[inside].mean(axis=0), points[inside].std(axis=0)
    assert (np.abs(body.center_of_mass / CM - mean) < 4.0 * spread / np.sqrt(inside.sum())).all()
    assert body.volume < 0.95 * CM**3 * sum(ConvexHull(cloud).volume for cloud in clouds)


def test_lengths_are_multiplied_by_the_scale():
    boxes = [corners_of(((0, 0, 0), (4, 2, 2))), corners_of(((2, 1, 0), (6, 3, 2)))]
    one, other = (pieced_object(boxes, scale=scale) for scale in (CM, 0.4 * CM))
    assert_is(
        other.body, 0.4**3 * one.body.volume, 0.4 * one.body.center_of_mass,
        0.4**5 * one.body.inertia,
    )  # fmt: skip
    for mine, its in zip(one.pieces, other.pieces, strict=True):
        np.testing.assert_allclose(its, 0.4 * mine, rtol=1e-12)


def test_flat_pieces_are_left_out():
    box, flat = corners_of(((0, 0, 0), (1, 1, 1))), np.array([[0, 0, 0], [9, 0, 0], [0, 9, 0]])
    thin = corners_of(((0, 0, 0), (9, 9, 1e-10)))
    found = pieced_object([flat, box, thin, flat[:2]], scale=CM)
    assert found.body.volume == pytest.approx(1e-6, rel=ROUNDING)
    assert len(found.pieces) == 1
    assert found.body.notes == ("3 of 4 pieces were flat and are left out",)
    with pytest.raises(gc.MeshError, match="all 2 pieces of the object are flat") as caught:
        pieced_object([flat, thin], scale=CM)
    assert caught.value.reason is MeshRefusal.ZERO_VOLUME


def test_a_piece_that_is_not_convex_is_taken_as_its_hull():
    """The hull of three cubes in an L has half a cube more."""
    parts = [((0, 0, 0), (1, 1, 1)), ((1, 0, 0), (2, 1, 1)), ((0, 1, 0), (1, 2, 1))]
    bent = pieced_object([corners_of(box) for box in parts], scale=CM).body
    beside = mesh_of(CM * np.array([(2, 0, 0), (3, 1, 1)]))
    found = pieced_object([Mesh(bent.vertices, bent.triangles), beside])
    assert found.body.volume == pytest.approx(4.5e-6, rel=ROUNDING)
    (note,) = found.body.notes
    assert note.startswith("1 of 2 pieces were not convex;")
    assert note.endswith("hold 0.5 cm^3 more")
    upside_down = Mesh(beside.vertices, beside.triangles[:, ::-1])
    assert pieced_object([upside_down]).body.notes == ()


@pytest.mark.parametrize(("gap", "words"), [(1e-4, "up to 0.001 mm"), (1.0, "more than 0.05 mm")])
def test_pieces_that_are_apart_are_one_rigid_body(gap, words):
    boxes = [((0, 0, 0), (1, 1, 1)), ((1 + gap, 0, 0), (5, 1, 1))]
    body = pieced_object([corners_of(box) for box in boxes], scale=CM).body
    assert_is(body, *union_of(CM * np.array(boxes)))
    assert body.notes == (
        f"the pieces make 2 parts that are {words} apart; they are taken as one rigid body",
    )


@pytest.mark.parametrize(
    ("pieces", "scale", "words"),
    [
        ([], 1.0, "expected 1 to 1000 convex pieces, got 0"),
        ([np.eye(3)] * (MOST_PIECES + 1), 1.0, "got 1001"),
        ([corners_of(((0, 0, 0), (1, 1, 1)))], 1e-5, "1e-05 m across"),
        ([corners_of(((0, 0, 0), (1, 1, 1)))], 100.0, "100 m across"),
        ([corners_of(((0, 0, 0), (1, 1, np.nan)))], 1.0, "finite"),
        ([corners_of(((0, 0, 0), (1, 1, 1)))], np.nan, "scale"),
        ([np.zeros((4, 2))], 1.0, "shape"),
        ([np.zeros((0, 3))], 1.0, "0 m across"),
    ],
)
def test_what_makes_no_object_is_refused(pieces, scale, words):
    with pytest.raises(InputError, match=words):
        pieced_object(pieces, scale=scale)


APART = [((0, 0, 0), (1, 1, 1)), ((2, 0, 0), (3, 1, 1))]
TOUCHING = [((0, 0, 0), (1, 1, 1)), ((1, 0, 0), (2, 1, 1))]
NESTED = [((0, 0, 0), (3, 3, 3)), ((1, 1, 1), (2, 2, 2))]


def merged(mesh):
    """Parts share vertices where they touch in the mesh that this returns."""
    points, order = np.unique(mesh.vertices, axis=0, return_inverse=True)
    return Mesh(points, order.ravel()[mesh.triangles])


def loose(mesh):
    """Each triangle has vertices of its own in the mesh that this returns, as in an STL file."""
    return Mesh(mesh.corners.reshape(-1, 3), np.arange(mesh.triangles.size).reshape(-1, 3))


@pytest.mark.parametrize("change", [lambda mesh: mesh, merged, loose])
@pytest.mark.parametrize("boxes", [APART, TOUCHING])
def test_convex_solids_of_one_mesh_are_told_apart(boxes, change):
    parts = convex_solids(change(mesh_of(*boxes)))
    found = sorted((part.vertices.min(axis=0).tolist(), part.volume) for part in parts)
    assert found == [(list(map(float, low)), pytest.approx(1.0)) for low, _ in boxes]


def test_other_meshes_are_not_convex_solids():
    hollow = mesh_of(*NESTED)
    hollow.triangles[12:] = hollow.triangles[12:, ::-1]
    bent = trimesh.creation.extrude_triangulation([[0, 0], [2, 0], [0.5, 0.5], [0, 2]],
                                                  [[0, 1, 2], [0, 2, 3]], 1.0)  # fmt: skip
    box = mesh_of(*APART)
    beside_bent = Mesh(
        np.vstack([bent.vertices, box.vertices + 5.0]),
        np.vstack([bent.faces, box.triangles + len(bent.vertices)]),
    )
    opened = Mesh(box.vertices, box.triangles[1:])
    beside_flake = Mesh(box.vertices, np.vstack([box.triangles[:12], [[8, 9, 10], [8, 10, 9]]]))
    for mesh in (mesh_of(APART[0]), hollow, beside_bent, opened, beside_flake):
        assert convex_solids(mesh) is None
