"""Parts that touch are united, in whatever file they are and however coordinates are rounded."""

import re

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

import grasp_core as gc
from grasp_core.errors import MeshRefusal
from grasp_core.objects.booleans import extrusion
from grasp_core.objects.surface import Mesh
from grasp_core.objects.touching_parts import pulled_apart
from tests.bad_input import mesh_texts

MM = 1e-3


def box(low, high):
    """A box between two corners, in centimetres: vertices and triangles."""
    mesh = trimesh.creation.box(np.subtract(high, low))
    return mesh.vertices + 0.5 * np.add(low, high), mesh.faces


def prism(outline, height, holes=(), low=0.0):
    solid = extrusion(outline, height, holes)
    return solid.moved((0.0, 0.0, low)).vertices, solid.triangles


def circle(count):
    angles = 2.0 * np.pi * np.arange(count) / count
    return np.column_stack([np.cos(angles), np.sin(angles)])


def sector(place):
    """One eighth of a ring."""
    inner, outer = 2.0 * circle(8)[[place, place - 7]], 4.0 * circle(8)[[place, place - 7]]
    return prism([inner[0], outer[0], outer[1], inner[1]], 3.0)


SQUARE = np.array([[-4.0, -4.0], [4.0, -4.0], [4.0, 4.0], [-4.0, 4.0]])
PLATE = box((0, 0, 0), (6, 4, 1))
PARTS = {
    "post": ([PLATE, box((2, 1, 1), (3, 3, 5))], 11, 32.0),
    "cross": ([box((0, 2, 0), (6, 4, 1)), box((2, 0, 1), (4, 6, 2))], 14, 24.0),
    "table": (
        [PLATE, *(box((x, y, -3), (x + 1, y + 1, 0)) for x in (0.5, 4.5) for y in (0.5, 2.5))],
        26, 36.0),
    "cubes": ([box((0, 0, z), (4, 4, z + 2)) for z in (0, 2, 4)], 6, 96.0),
    "ring": ([sector(place) for place in range(8)], 18, None),
    "peg": ([prism(SQUARE, 4, [1.5 * circle(24)]), prism(1.5 * circle(24), 9, low=-2)], 56, None),
}  # fmt: skip
ROUNDED = {
    "double": lambda points: points,
    "single": lambda points: points.astype(np.float32).astype(float),
    "six digits": np.vectorize(lambda number: float(f"{number:.6g}")),
}
TURN = trimesh.transformations.rotation_matrix(0.7, [3.0, 1.0, 2.0])[:3, :3]


def together(parts, rounding="double", *, turn=TURN):
    """The vertices of turned parts [mm], rounded, and all triangles."""
    points, faces = trimesh.util.append_faces(*zip(*parts, strict=True))
    return ROUNDED[rounding](10.0 * points @ turn.T), faces


def written(folder, kind, points, faces):
    """Write a mesh as a text with vertices in common, or as triangles each for itself."""
    path = folder / f"part.{kind}"
    if kind == "obj":
        path.write_text(mesh_texts.obj(points.tolist(), faces.tolist()))
    else:
        mesh = trimesh.Trimesh(points, faces, process=kind == "off")
        form = {"digits": 17} if kind == "off" else {}
        data = mesh.export(file_type=kind, **form)
        path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return path


def volume_of(parts, exact):
    return exact or sum(Mesh(*part).volume for part in parts)


@pytest.mark.parametrize("kind", ["obj", "stl", "off"])
@pytest.mark.parametrize("name", PARTS)
def test_turned_parts_that_touch_are_united_in_every_format(name, kind, tmp_path):
    parts, faces, exact = PARTS[name]
    for rounding in ("double", "single"):
        body = gc.load_polyhedron(written(tmp_path, kind, *together(parts, rounding)), unit="mm")
        assert f"{len(parts)} parts that overlap or touch were united" in body.notes
        assert len(body.faces) == faces
        assert body.volume == pytest.approx(1e-6 * volume_of(parts, exact), rel=1e-5)


@pytest.mark.parametrize("name", PARTS)
def test_coordinates_with_few_digits_are_no_slits(name, tmp_path):
    parts, faces, exact = PARTS[name]
    path = written(tmp_path, "obj", *together(parts, "six digits"))
    body = gc.load_polyhedron(path, unit="mm")
    assert len(body.faces) == faces
    assert body.volume == pytest.approx(1e-6 * volume_of(parts, exact), rel=1e-4)


@pytest.mark.parametrize("name", ["post", "table", "cubes", "ring"])
@pytest.mark.parametrize("gap", [5e-5, 5e-4])
def test_pieces_with_gaps_are_refused_with_the_flag_that_unites_them(name, gap, tmp_path):
    """Each piece shrinks about its middle, as pieces of a convex decomposition may."""
    parts, faces, exact = PARTS[name]
    shrunk = [
        ((points - points.mean(axis=0)) * (1.0 - gap) + points.mean(axis=0), triangles)
        for points, triangles in parts
    ]
    points, triangles = together(shrunk)
    path = written(tmp_path, "stl", points, triangles)
    with pytest.raises(gc.MeshError, match=r"up to .* mm apart for touching") as caught:
        gc.load_polyhedron(path, unit="mm")
    flatness = float(re.search(r"--flatness-m ([\d.e-]+)", str(caught.value))[1])
    assert flatness < 10.0 * gap * MM * np.ptp(points)
    body = gc.load_polyhedron(path, unit="mm", flatness_m=flatness)
    assert len(body.faces) == faces
    assert body.volume == pytest.approx(1e-6 * volume_of(parts, exact), rel=10.0 * gap)
    whole = trimesh.Trimesh(MM * points, triangles, process=False)
    off = trimesh.proximity.closest_point_naive(whole, body.vertices)[1]
    assert off.max() <= 2.0 * flatness


@pytest.mark.parametrize("turn", [np.eye(3), TURN])
def test_parts_with_common_edges_are_told_apart(turn):
    cubes = [box((x, y, z), (x + 1, y + 1, z + 1)) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    for some, count in ((cubes, 8), (cubes[1:], 7), ([cubes[0], cubes[3]], 2), (cubes[::3], 3)):
        points, faces = together(some, turn=turn)
        points, label = np.unique(np.round(points, 9), axis=0, return_inverse=True)
        apart = pulled_apart(Mesh(points, label.ravel()[faces]))
        assert apart.edges.fault() is None
        parts = [Mesh(apart.vertices, apart.triangles[apart.connected == part])
                 for part in range(apart.connected.max() + 1)]  # fmt: skip
        assert [part.volume for part in parts] == pytest.approx([1000.0] * count)
    assert pulled_apart(Mesh(*box((0, 0, 0), (1, 1, 1)))) is None


@pytest.mark.parametrize("kind", ["obj", "stl", "off"])
def test_parts_that_only_an_edge_connects_are_no_solid(kind, tmp_path):
    """The third part is pressed into the first, and must not reach the second by that."""
    one, two, three = (
        box((2, 0, 1), (3, 3, 5)),
        box((2, 4, 1), (5, 5, 5)),
        box((2, 2, 0), (3, 4, 1)),
    )
    beside = [box((0, 0, 0), (1, 1, 1)), box((1, 1, 0), (2, 2, 1))]
    for parts in (beside, [one, two, three]):
        for turn in (np.eye(3), TURN):
            path = written(tmp_path, kind, *together(parts, "single", turn=turn))
            with pytest.raises(gc.MeshError, match="meet in edges or corners only") as caught:
                gc.load_polyhedron(path, unit="mm")
            assert caught.value.reason is MeshRefusal.SEPARATE


def test_files_of_every_kind_give_the_same_solid(tmp_path):
    """An L of two boxes that have an edge in common."""
    points, faces = together([PLATE, box((0, 0, 1), (1, 4, 5))], turn=np.eye(3))
    bodies = [
        gc.load_polyhedron(written(tmp_path, kind, points, faces), unit="mm")
        for kind in ("obj", "stl", "off", "ply")
    ]
    assert {len(body.faces) for body in bodies} == {8}
    assert {round(1e9 * body.volume, 6) for body in bodies} == {40000.0}
    assert len({body.content_sha256 for body in bodies}) == 1


@pytest.mark.parametrize("seed", range(6))
def test_flush_walls_of_turned_parts_are_one_face(seed):
    """Rounding makes slivers between walls in one plane, which belong to the faces beside them."""
    parts = [
        trimesh.creation.box(bounds=bounds)
        for bounds in ([[0, 0, 0], [60, 20, 30]], [[0, 20, 0], [20, 60, 30]])
    ]
    both = trimesh.util.concatenate(parts)
    turn = Rotation.from_rotvec(np.random.default_rng(seed).normal(size=3))
    soup = turn.apply(both.vertices)[both.faces].reshape(-1, 3).astype(np.float32) / 1000.0
    body = gc.Polyhedron.from_mesh(soup, np.arange(len(soup)).reshape(-1, 3))
    assert len(body.faces) == 8
    assert body.volume == pytest.approx(60e-6, rel=1e-5)
    assert sum(face.area for face in body.faces) == pytest.approx(11_200e-6, rel=1e-5)
