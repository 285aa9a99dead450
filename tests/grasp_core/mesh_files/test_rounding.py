"""The rounding that a file's numbers show covers the true one, and is hardly more than that."""

import numpy as np
import pytest
import trimesh

from grasp_core.mesh_files.reading import mesh_of_bytes
from tests.bad_input.mesh_texts import obj, off, ply, stl, stl_text

MOST = 50_000
FORMATS = ("%g", "%.6f", "%.5e", "%.9g")
LOOSEST = 20.0
"""Largest ratio of the rounding that a file shows to that of its coordinates."""


def shape(corners):
    """Vertices of a ball [m] that is turned and dented, and its triangles."""
    ball = trimesh.creation.uv_sphere(0.04, count=[corners, corners])
    turned = ball.vertices @ np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    return turned * [1.0, 0.7, 0.45] * (1.0 + 0.1 * np.sin(60.0 * turned[:, :1])), ball.faces


def texts(points, faces, form):
    """The texts of all formats, with coordinates in a form, and other numbers in full length."""
    said = [[form % x for x in point] for point in points.tolist()]
    rows = [" ".join(three) for three in said]
    full = " 0.12345678901234567 0.1 0.2"
    head = f"{len(points)} {len(faces)} 0"
    triangles = [f"3 {i} {j} {k}" for i, j, k in faces.tolist()]
    table = "\n".join([f"{row}{full}" for row in rows] + triangles) + "\n"
    coloured = ply(len(points), len(faces), kind="double", body=b"").decode()
    colours = "".join(f"property double {name}\n" for name in "rgb")
    facets = [
        f"facet normal{full}\nouter loop\n" + "".join(f"vertex {rows[i]}\n" for i in face)
        + "endloop\nendfacet\n" for face in faces.tolist()
    ]  # fmt: skip
    return {
        "obj": "".join(f"v {row}{full}\nvn{full}\n" for row in rows)
        + "".join(f"f {i} {j} {k}\n" for i, j, k in (faces + 1).tolist()),
        "off": f"COFF\n{head}\n{table}",
        "ply": coloured.replace("element face", colours + "element face") + table,
        "stl": "solid a\n" + "".join(facets) + "endsolid a\n",
    }


def shows_its_rounding(kind, data, corners):
    mesh = mesh_of_bytes(kind, data, MOST)
    off_by = np.abs(mesh.vertices[mesh.triangles] - corners).max()
    assert 0.0 < off_by <= 1.0001 * mesh.rounding, kind
    assert mesh.rounding <= LOOSEST * off_by, kind


@pytest.mark.parametrize("offset", [0.0, 2.0])
@pytest.mark.parametrize("unit", [1.0, 1000.0])
@pytest.mark.parametrize("form", FORMATS)
def test_a_text_shows_its_own_rounding(form, unit, offset):
    points, faces = shape(12)
    points = (points + np.multiply(offset, [1.0, -0.2, 0.0])) * unit
    for kind, text in texts(points, faces, form).items():
        shows_its_rounding(kind, text.encode(), points[faces])


@pytest.mark.parametrize("offset", [0.0, 2.0])
@pytest.mark.parametrize("unit", [1.0, 1000.0])
def test_a_binary_file_shows_that_of_single_precision(unit, offset):
    points, faces = shape(12)
    points = (points + np.multiply(offset, [1.0, -0.2, 0.0])) * unit
    held = trimesh.Trimesh(points, faces, process=False)
    files = {"stl": stl(points.tolist(), faces.tolist()),
             "ply": held.export(file_type="ply"), "glb": held.export(file_type="glb")}  # fmt: skip
    for kind, data in files.items():
        shows_its_rounding(kind, data, points[faces])


@pytest.mark.parametrize("offset", [0.0, 0.3, 2.0])
@pytest.mark.parametrize("form", ["%.9g", "%.8g"])
def test_a_text_of_single_precision_shows_that(form, offset):
    points, faces = shape(12)
    points = points + np.multiply(offset, [1.0, -0.2, 0.0])
    for kind, text in texts(points.astype(np.float32).astype(float), faces, form).items():
        shows_its_rounding(kind, text.encode(), points[faces])


def test_numbers_in_full_length_or_typed_by_hand_are_not_rounded():
    typed = {"obj": obj(), "off": off(), "ply": ply(kind="double").decode(), "stl": stl_text()}
    for kind, text in (*texts(*shape(12), "%r").items(), *typed.items()):
        assert mesh_of_bytes(kind, text.encode(), MOST).rounding == 0.0, kind


def test_one_large_coordinate_far_down_a_long_file_counts():
    points, faces = shape(80)
    points[2048:] *= 7.0
    points[len(points) - 100] = (41.23456789, 0.0, 0.0)
    for kind, text in texts(points, faces, "%g").items():
        mesh = mesh_of_bytes(kind, text.encode(), MOST)
        assert len(mesh.vertices) > 5000
        assert mesh.rounding == pytest.approx(0.5e-4, rel=0.05), kind
