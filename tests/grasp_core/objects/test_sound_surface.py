"""The rounding of coordinates changes no planar face, and what is larger than rounding does."""

import itertools
import math

import numpy as np
import pytest
import trimesh

import grasp_core as gc
from grasp_core.errors import MeshRefusal
from tests.bad_input import mesh_texts

TURN = trimesh.transformations.rotation_matrix(0.7, [3.0, 1.0, 2.0])[:3, :3]
OFFSETS = [0.0, 0.1, 0.3, 2.0]
SLANT = np.array([1.0, -0.4, 0.7]) / np.linalg.norm([1.0, -0.4, 0.7])


def box():
    return trimesh.creation.box((0.05, 0.06, 0.08))


def prism():
    return trimesh.creation.cylinder(0.03, 0.05, sections=6)


SHAPES = {"box": (box, 6), "prism": (prism, 8)}


def stl_text(points, faces):
    """A text STL of six significant digits."""
    facets = [
        "facet normal 0 0 0\nouter loop\n"
        + "".join("vertex {:g} {:g} {:g}\n".format(*points[i]) for i in face)
        + "endloop\nendfacet\n"
        for face in faces
    ]
    return ("solid part\n" + "".join(facets) + "endsolid part\n").encode()


def obj(points, faces):
    """An OBJ of six decimals."""
    rows = ["v {:.6f} {:.6f} {:.6f}\n".format(*point) for point in points]
    rows += ["f {} {} {}\n".format(*(i + 1 for i in face)) for face in faces]
    return "".join(rows).encode()


def off(points, faces):
    """An OFF of nine significant digits."""
    rows = ["{:.9g} {:.9g} {:.9g}\n".format(*point) for point in points]
    rows += ["3 {} {} {}\n".format(*face) for face in faces]
    return f"OFF\n{len(points)} {len(faces)} 0\n{''.join(rows)}".encode()


def stl(points, faces):
    return mesh_texts.stl(points, faces)


def ply(points, faces):
    return trimesh.Trimesh(points, faces, process=False).export(file_type="ply")


WRITERS = {"stl %g": stl_text, "obj %.6f": obj, "off %.9g": off, "stl": stl, "ply": ply}


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
    assert len(read("stl %g", rounded, tmp_path, offset=2.0).faces) == 8


def test_an_exact_mesh_has_no_rounding_to_allow_for():
    mesh = box()
    body = gc.Polyhedron.from_mesh(mesh.vertices @ TURN.T, mesh.faces)
    assert body.surface.flatness_m == 0.0
    assert body.notes == ()
    single = (mesh.vertices @ TURN.T + 2.0 * SLANT).astype(np.float32).astype(float)
    assert 1e-7 < gc.Polyhedron.from_mesh(single, mesh.faces).surface.flatness_m < 1e-5


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


@pytest.mark.parametrize("seed", range(3))
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


def test_a_missing_triangle_and_a_wrong_winding_are_mended_together():
    mesh = box().subdivide().subdivide()
    faces = np.array(mesh.faces)
    faces[20:60] = faces[20:60, ::-1]
    body = gc.Polyhedron.from_mesh(mesh.vertices, faces[1:, ::-1])
    assert body.volume == pytest.approx(mesh.volume, rel=1e-12)
    assert body.surface.holes == 1
    assert len(body.notes) == 3


def test_triangles_without_area_alone_are_no_solid():
    with pytest.raises(gc.MeshError, match="no triangle has an area") as caught:
        gc.Polyhedron.from_mesh([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]], [[0, 1, 1], [2, 2, 2]])
    assert caught.value.reason is gc.MeshRefusal.ZERO_VOLUME
