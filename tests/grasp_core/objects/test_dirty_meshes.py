"""Dirty files of a shape give the grasps of the clean one, less what was lost, or a refusal."""

import numpy as np
import pytest

import grasp_core as gc
from tests.bad_input.mesh_texts import stl_text
from tests.grasp_core.dirty_meshes import REFUSALS, plan, pushes_into, shapes, ways

EVERYDAY = ("dodecahedron",)
KNOWN = 0.02
"""Largest error of a volume that is stated as known."""
LEAST = {True: 0.5, False: 0.7}
"""Least radius of the best grasp relative to the clean shape's, where triangles are missing or not:
a hole in the best patch takes a part of it, and other triangles give other patches."""
WAYS = 9


def load(dirty, mesh, faces, folder):
    """Load a dirty mesh from memory, or the text of a file where there is none."""
    if dirty is not None:
        return gc.Polyhedron.from_mesh(dirty.vertices, dirty.triangles, faces=faces), dirty.moved
    path = folder / "part.stl"
    # millimetres with six significant digits, as OpenSCAD writes them
    points = [[float(f"{1e3 * x:g}") for x in point] for point in mesh.vertices]
    path.write_text(stl_text(points, mesh.faces))
    return gc.load_polyhedron(path, unit="mm", faces=faces), np.zeros(3)


def check(name, folder):
    """Check a shape that is dirty in every way; count what was read, and the fingers tried."""
    mesh, number = shapes()[name], list(shapes()).index(name)
    whole = gc.Polyhedron.from_mesh(mesh.vertices, mesh.faces)
    faces, clean = "patches" if whole.patches else "planar", plan(whole, 3)
    read, fingers, why = 0, 0, []
    files = {**ways(mesh, number), "text of six digits": None}
    assert len(files) == WAYS
    for way, dirty in files.items():
        missing = dirty is not None and dirty.missing > 0.0
        try:
            body, moved = load(dirty, mesh, faces, folder)
        except gc.MeshError as refused:
            why.append((refused.reason, missing))
            continue
        read += 1
        if body.surface.closed:
            assert body.volume == pytest.approx(mesh.volume, rel=KNOWN), way
        found = plan(body, 3)
        for grasp in found:
            assert pushes_into(mesh, body, grasp, moved).all(), way
            fingers += 4
        if clean:
            assert found[0].radius >= LEAST[missing] * clean[0].radius, way
    assert all(reason in REFUSALS and missing for reason, missing in why)
    return read, fingers, bool(clean)


WHOLE_WAYS = 5
"""Number of ways in which no triangle is missing, so that a shape must be read."""


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=() if name in EVERYDAY else pytest.mark.slow) for name in shapes()],
)
def test_a_dirty_shape_is_grasped_where_it_is_or_refused(name, tmp_path):
    read, fingers, has_grasps = check(name, tmp_path)
    assert read >= WHOLE_WAYS
    assert fingers >= 4 * read or not has_grasps
