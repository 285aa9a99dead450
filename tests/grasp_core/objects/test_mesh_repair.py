"""The rounding of coordinates changes no planar face, and what is larger than rounding does."""

import itertools
import math

import numpy as np
import pytest
import trimesh

import grasp_core as gc
from grasp_core.errors import MeshRefusal
from grasp_core.objects.booleans import Solid
from grasp_core.objects.mesh_repair import caps_of
from grasp_core.objects.surface import Mesh, MeshEdges
from tests.bad_input import mesh_texts

TURN = trimesh.transformations.rotation_matrix(0.7, [3.0, 1.0, 2.0])[:3, :3]
OFFSETS = [0.0, 2.0]
SLANT = np.array([1.0, -0.4, 0.7]) / np.linalg.norm([1.0, -0.4, 0.7])


def box():
    return trimesh.creation.box((0.05, 0.06, 0.08))


def prism():
    return trimesh.creation.cylinder(0.03, 0.05, sections=6)


SHAPES = {"box": (box, 6), "prism": (prism, 8)}


def rounded(points, form):
    return [[float(form % x) for x in point] for point in points]


WRITERS = {
    "stl %g": lambda p, f: mesh_texts.stl_text(rounded(p, "%g"), f).encode(),
    "obj %.6f": lambda p, f: mesh_texts.obj(rounded(p, "%.6f"), f).encode(),
    "off %.9g": lambda p, f: mesh_texts.off(f"{len(p)} {len(f)} 0", rounded(p, "%.9g"), f).encode(),
    "stl": mesh_texts.stl,
    "ply": lambda p, f: trimesh.Trimesh(p, f, process=False).export(file_type="ply"),
}


def read(writer, mesh, folder, *, offset=0.0, unit="mm", **choices):
    """Write a turned mesh [m] in a unit, some way from the origin, and read it."""
    size = {"m": 1.0, "mm": 1000.0}[unit]
    points = (mesh.vertices @ TURN.T + offset * SLANT) * size
    path = folder / f"part.{writer.split()[0]}"
    path.write_bytes(WRITERS[writer](points.tolist(), mesh.faces.tolist()))
    return gc.load_polyhedron(path, unit=unit, **choices)


@pytest.mark.parametrize("unit", ["m", "mm"])
@pytest.mark.parametrize("writer", WRITERS)
@pytest.mark.parametrize("shape", SHAPES)
def test_a_rounded_solid_has_the_faces_of_the_exact_one_in_the_same_order(
    shape, writer, unit, tmp_path
):
    make, count = SHAPES[shape]
    mesh = make()
    exact = gc.Polyhedron.from_mesh(mesh.vertices @ TURN.T, mesh.faces)
    assert len(exact.faces) == count
    for offset in OFFSETS:
        body = read(writer, mesh, tmp_path, offset=offset, unit=unit)
        assert len(body.faces) == count, offset
        angles = np.linalg.norm(np.cross(body.normals, exact.normals), axis=1)
        assert angles.max() < 1e-3, offset
        assert (body.normals * exact.normals).sum(axis=1).min() > 0.0
        assert [len(f.polygon) for f in body.faces] == [len(f.polygon) for f in exact.faces]
        assert body.volume == pytest.approx(exact.volume, rel=1e-3)
        assert body.surface.closed
        assert len(body.surface.caps) == 0


def chamfered(depth):
    """A box one of whose edges is cut off, to a depth [m] on both of its faces."""
    low, high = np.array([-0.025, -0.03, -0.04]), np.array([0.025, 0.03, 0.04])
    corners = [
        point for point in itertools.product(*zip(low, high, strict=True))
        if point[:2] != (high[0], high[1])
    ]  # fmt: skip
    for z in (low[2], high[2]):
        corners += [(high[0] - depth, high[1], z), (high[0], high[1] - depth, z)]
    return trimesh.convex.convex_hull(np.array(corners))


@pytest.mark.parametrize("writer", WRITERS)
def test_a_chamfer_larger_than_the_rounding_is_a_face(writer, tmp_path):
    """Six digits of at most 50 mm round by 5e-5 mm at most; the chamfer is 0.05 mm deep."""
    mesh = chamfered(5e-5)
    body = read(writer, mesh, tmp_path)
    assert len(body.faces) == 7
    small = min(body.faces, key=lambda face: face.area)
    assert small.area == pytest.approx(5e-5 * math.sqrt(2.0) * 0.08, rel=0.05)
    assert small.normal @ TURN @ [1.0, 1.0, 0.0] == pytest.approx(-math.sqrt(2.0), abs=0.01)


def roof(rise):
    """A box whose top is two slopes that meet in a ridge."""
    corners = [(x, y, z) for x in (-0.025, 0.025) for y in (-0.03, 0.03) for z in (-0.04, 0.04)]
    return trimesh.convex.convex_hull(np.array([*corners, (-0.025, 0, 0.04 + rise),
                                                (0.025, 0, 0.04 + rise)]))  # fmt: skip


def test_a_given_flatness_decides_which_faces_are_one(tmp_path):
    shallow, rounded = roof(1e-5), prism()
    for writer in WRITERS:
        assert len(read(writer, shallow, tmp_path).faces) == 7, writer
        merged = read(writer, shallow, tmp_path, flatness_m=1e-4)
        assert len(merged.faces) == 6, writer
        assert merged.surface.flatness_m == 1e-4
        assert any("corners are up to" in note for note in merged.notes)
    strict = read("stl %g", rounded, tmp_path, offset=2.0, flatness_m=0.0)
    assert len(strict.faces) > 8
    assert strict.surface.flatness_m == 0.0
    with pytest.raises(gc.InputError, match=r"at most 0\.1 of the object's extent"):
        read("stl %g", rounded, tmp_path, offset=2.0, flatness_m=1.0)
    assert len(read("stl %g", rounded, tmp_path, offset=2.0).faces) == 8


def test_vertices_that_rounding_moved_apart_are_joined():
    """Each triangle of a soup has corners of its own, off by less than half the flatness."""
    mesh = box().subdivide()
    off = np.random.default_rng(3).uniform(-1.0, 1.0, (len(mesh.faces), 3, 3)) * 1e-6
    soup = (mesh.triangles + off).reshape(-1, 3)
    faces = np.arange(len(soup)).reshape(-1, 3)
    body = gc.Polyhedron.from_mesh(soup, faces, flatness_m=1e-5)
    assert len(body.vertices) == len(mesh.vertices)
    assert len(body.faces) == 6
    assert body.volume == pytest.approx(mesh.volume, rel=1e-3)
    assert body.notes[0] == "vertices that rounding had moved apart were joined"
    with pytest.raises(gc.MeshError) as caught:
        gc.Polyhedron.from_mesh(soup, faces, flatness_m=0.0)
    assert caught.value.reason in {MeshRefusal.OPEN, MeshRefusal.SEPARATE}


@pytest.mark.parametrize("behind", [False, True])
def test_triangles_that_are_there_twice_are_dropped(behind):
    mesh = box()
    again = mesh.faces[:4][:, ::-1] if behind else np.roll(mesh.faces[:4], 1, axis=1)
    body = gc.Polyhedron.from_mesh(mesh.vertices, np.vstack([again, mesh.faces]))
    assert body.notes[0] == "dropped 4 triangles that were there twice"
    assert body.volume == pytest.approx(mesh.volume)
    assert (len(body.triangles), len(body.faces)) == (12, 6)


def test_a_wall_that_two_parts_share_is_not_dropped():
    """Two boxes of which one is inside the other, with one face in common."""
    inner = trimesh.creation.box((0.05, 0.06, 0.04))
    inner.apply_translation([0.0, 0.0, 0.02])
    whole = trimesh.util.concatenate([box(), inner])
    with pytest.raises(gc.MeshError) as caught:
        gc.Polyhedron.from_mesh(whole.vertices, whole.faces)
    assert caught.value.reason in {MeshRefusal.OVERLAP, MeshRefusal.NON_MANIFOLD}


@pytest.mark.parametrize("seed", [0])
def test_a_solid_wound_at_random_has_the_faces_of_the_clean_one(seed):
    mesh = prism()
    clean = gc.Polyhedron.from_mesh(mesh.vertices, mesh.faces)
    wrong = np.random.default_rng(seed).random(len(mesh.faces)) < 0.4
    body = gc.Polyhedron.from_mesh(
        mesh.vertices, np.where(wrong[:, None], mesh.faces[:, ::-1], mesh.faces)
    )
    np.testing.assert_allclose(body.normals, clean.normals, atol=1e-12)
    assert body.volume == pytest.approx(clean.volume)
    assert any("wound against their neighbours were turned" in note for note in body.notes)


SIZE = (0.1, 0.2, 0.3)
FRICTION = 0.5


def grid(times):
    """A box whose triangles are each cut in four, some times, and its volume."""
    box = trimesh.creation.box(SIZE)
    for _ in range(times):
        box = box.subdivide()
    return box


def around(mesh, place):
    """Numbers of the triangles around the vertex that is nearest to a place."""
    vertex = np.linalg.norm(mesh.vertices - place, axis=1).argmin()
    return np.flatnonzero((mesh.faces == vertex).any(axis=1))


def check_whole(body, missing):
    """Check that a box has volume, centre, moments and faces of the whole one."""
    whole = trimesh.creation.box(SIZE)
    assert body.surface.closed
    assert body.surface.volume_source == "capped surface"
    assert body.volume == pytest.approx(0.006, rel=1e-12)
    np.testing.assert_allclose(body.center_of_mass, 0.0, atol=1e-15)
    np.testing.assert_allclose(body.inertia, whole.moment_inertia, rtol=1e-9, atol=1e-15)
    assert body.mass_at(1000.0) == pytest.approx(6.0)
    assert len({tuple(np.round(face.normal)) for face in body.faces}) == 6
    assert len(body.surface.caps) == missing
    caps = body.vertices[body.triangles[body.surface.caps]]
    crosses = np.cross(caps[:, 1] - caps[:, 0], caps[:, 2] - caps[:, 0])
    assert (np.einsum("ki,ki->k", crosses, caps.mean(axis=1)) > 0.0).all(), "wound inwards"
    lost = 0.5 * float(np.linalg.norm(crosses, axis=1).sum())
    assert sum(face.area for face in body.faces) == pytest.approx(whole.area - lost)
    return lost


@pytest.mark.parametrize("gone", [0, 93])
def test_one_missing_triangle_does_not_change_volume_centre_and_moments(gone):
    mesh = grid(2)
    body = gc.Polyhedron.from_mesh(mesh.vertices, np.delete(mesh.faces, gone, axis=0))
    lost = check_whole(body, 1)
    assert lost == pytest.approx(mesh.area_faces[gone])
    sides = mesh.triangles[gone] - np.roll(mesh.triangles[gone], 1, axis=0)
    assert body.surface.holes == 1
    assert body.surface.largest_hole_m == pytest.approx(np.linalg.norm(sides, axis=1).max())
    assert 0.0 < body.surface.volume_error <= 0.02
    (note,) = body.notes
    assert note.startswith("1 hole in the surface")
    assert "no finger is placed there" in note


def test_a_hole_that_may_hide_more_than_two_hundredths_of_the_volume_stays_open():
    mesh = grid(2)
    gone = around(mesh, [0.05, 0.0, 0.0])
    left = np.delete(mesh.faces, gone, axis=0)
    assert caps_of(Mesh(mesh.vertices, left)).hidden > 0.02 * mesh.volume
    with pytest.raises(gc.MeshError, match="belong to one triangle only") as caught:
        gc.Polyhedron.from_mesh(mesh.vertices, left)
    assert caught.value.reason is MeshRefusal.OPEN
    assert not gc.Polyhedron.from_mesh(mesh.vertices, left, faces="patches").surface.closed


@pytest.mark.parametrize("sections", [64, 128])
def test_a_long_triangle_of_a_thin_pipe_hides_little(sections):
    """Half a ball over its length would be larger than all the material."""
    pipe = trimesh.creation.annulus(0.009, 0.011, 0.15, sections=sections)
    long = np.flatnonzero(np.ptp(pipe.triangles, axis=1).max(axis=1) > 0.14)
    beside = MeshEdges.of(pipe.faces).neighbours()[long[0]]
    for gone in (long[:1], [long[0], beside[np.isin(beside, long)][0]]):
        body = gc.Polyhedron.from_mesh(pipe.vertices, np.delete(pipe.faces, gone, axis=0))
        assert body.surface.volume_source == "capped surface"
        assert body.volume == pytest.approx(pipe.volume, rel=5e-3)
        assert abs(body.volume / pipe.volume - 1.0) <= body.surface.volume_error <= 0.02


@pytest.mark.parametrize("seed", range(2))
def test_crooked_holes_are_closed_and_hide_no_more_than_they_say(seed):
    rng = np.random.default_rng(seed)
    mesh = trimesh.creation.icosphere(subdivisions=3)
    across, gone = MeshEdges.of(mesh.faces).neighbours(), [int(rng.integers(len(mesh.faces)))]
    while len(gone) < 40:
        gone.append(int(rng.choice(np.setdiff1d(across[gone], gone))))
    for wound in (mesh.faces, mesh.faces[:, ::-1]):
        left = np.delete(wound, gone, axis=0)
        caps = caps_of(Mesh(mesh.vertices, left))
        whole = np.concatenate([left, caps.triangles])
        assert not MeshEdges.of(whole).balance.any()
        assert abs(abs(Solid(mesh.vertices, whole).volume) - mesh.volume) <= caps.hidden


@pytest.mark.parametrize("off", [0.0, 1e-9, 1e-8])
def test_a_vertex_on_the_edge_of_a_neighbour_costs_no_face_a_place(off):
    mesh = trimesh.creation.box(SIZE)
    a, b, c = mesh.faces[0]
    middle = 0.5 * (mesh.vertices[a] + mesh.vertices[b]) + off * np.array([1.0, -1.0, 1.0])
    points = np.vstack([mesh.vertices, middle])
    faces = np.vstack([mesh.faces[1:], [a, 8, c], [8, b, c]])
    body, whole = (
        gc.Polyhedron.from_mesh(points, faces), gc.Polyhedron.from_mesh(mesh.vertices, mesh.faces)
    )  # fmt: skip
    assert body.surface.volume_source == "surface"
    assert body.surface.holes == len(body.surface.caps) == 0
    assert body.notes == ("cracks between triangles that meet were closed",)
    assert len(body.faces) == 6
    assert body.volume == pytest.approx(0.006, rel=1e-6)
    key = [tuple(np.round(face.normal).astype(int)) for face in whole.faces]
    for face in body.faces:
        clean = whole.faces[key.index(tuple(np.round(face.normal).astype(int)))]
        assert face.area == pytest.approx(clean.area, rel=1e-6)
        assert len(face.pieces) == len(clean.pieces) == 1
        np.testing.assert_allclose(face.centroid, clean.centroid, atol=1e-8)


def nearest(body, places):
    """Number of the triangle that is nearest to each place."""
    mesh = trimesh.Trimesh(body.vertices, body.triangles, process=False)
    return trimesh.proximity.closest_point_naive(mesh, places)[2]


def contacts(body):
    """Contacts of the best grasps, (n, 3) [m]."""
    grasps = gc.plan(body, FRICTION, families="concurrent", limit=10).grasps
    return np.concatenate([grasp.positions for grasp in grasps])


@pytest.mark.parametrize("kind", ["planar", pytest.param("patches", marks=pytest.mark.slow)])
def test_no_finger_stands_on_a_cap(kind):
    """Triangles are missing just where the best grasps of the whole body have their fingers."""
    mesh = grid(3) if kind == "planar" else trimesh.creation.icosphere(subdivisions=3, radius=0.05)
    whole = gc.Polyhedron.from_mesh(mesh.vertices, mesh.faces, faces=kind)
    gone = np.unique(nearest(whole, contacts(whole)[:8]))
    left = np.delete(whole.triangles, gone, axis=0)
    body = gc.Polyhedron.from_mesh(whole.vertices, left, faces=kind)
    assert len(body.surface.caps) == len(gone) >= 5
    fingers = contacts(body)
    assert len(fingers) == 40
    assert not np.isin(nearest(body, fingers), body.surface.caps).any()
    assert np.isin(nearest(body, contacts(whole)), body.surface.caps).any()
