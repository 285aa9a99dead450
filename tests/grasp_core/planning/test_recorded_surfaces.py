"""What is known of a surface survives files, and files that say what is not so are refused."""

import json
from functools import cache

import numpy as np
import pytest
import trimesh

import grasp_core as gc

UNIT = 0.01


def together(*parts):
    """One body of boxes between corners, in units."""
    meshes = [trimesh.creation.box(bounds=UNIT * np.array(each, dtype=float)) for each in parts]
    whole = trimesh.util.concatenate(meshes)
    return gc.Polyhedron.from_mesh(whole.vertices, whole.faces, name="boxes")


@cache
def capped():
    mesh = trimesh.creation.box((0.05, 0.06, 0.07)).subdivide().subdivide()
    left = np.delete(mesh.faces, [3, 70], axis=0)
    return gc.Polyhedron.from_mesh(mesh.vertices, left, name="capped")


def rounded():
    mesh = trimesh.creation.box((0.05, 0.06, 0.07))
    turn = trimesh.transformations.rotation_matrix(0.5, [1, 2, 3])[:3, :3]
    points = np.round(mesh.vertices @ turn, 6)
    return gc.Polyhedron.from_mesh(points, mesh.faces, name="rounded", flatness_m=4e-6)


@cache
def opened():
    mesh = trimesh.creation.icosphere(subdivisions=2, radius=0.05)
    left = mesh.faces[mesh.triangles_center[:, 2] < 0.042]
    return gc.Polyhedron.from_mesh(mesh.vertices, left[:, ::-1], name="opened")


def speckled():
    return together(((0, 0, 0), (6, 6, 6)), ((8, 0, 0), (8.5, 0.5, 0.5)))


def meeting_in_an_edge():
    """Two boxes that share an edge, and a third that holds them together."""
    return together(((0, 0, 0), (2, 2, 2)), ((2, 2, 0), (4, 4, 2)), ((1, 1, 1.5), (3, 3, 3)))


def meeting_in_a_corner():
    """Two boxes that share a corner, which a bow of three more holds together."""
    return together(
        ((0, 0, 0), (2, 2, 2)), ((2, 2, 2), (4, 4, 4)),
        ((0, 0, 1), (1, 1, 6)), ((0, 0, 5), (4, 4, 6)), ((3, 3, 3), (4, 4, 6)),
    )  # fmt: skip


def meets_itself(body):
    return len(np.unique(body.vertices, axis=0)) < len(body.vertices)


BODIES = {
    capped: lambda body: len(body.surface.caps) == 2,
    rounded: lambda body: body.surface.flatness_m == 4e-6,
    opened: lambda body: not body.surface.closed,
    speckled: lambda body: body.surface.dropped > 0.0,
    meeting_in_an_edge: meets_itself,
    meeting_in_a_corner: meets_itself,
}
"""Bodies, and what tells that they are what they are called."""


@pytest.mark.parametrize("make", BODIES)
def test_a_body_and_what_is_known_of_it_come_back_from_a_file(make, tmp_path):
    body = make()
    assert BODIES[make](body)
    plan = gc.plan(body, 0.5, families="concurrent", limit=2)
    assert plan.grasps
    found = gc.load_grasps(gc.save_grasps(tmp_path / "grasps.json", plan))
    assert found.body == body
    assert found.body.surface == body.surface
    assert found.body.notes == body.notes
    assert found == plan
    again = gc.save_grasps(tmp_path / "again.json", found)
    assert again.read_bytes() == (tmp_path / "grasps.json").read_bytes()


def changed(body, tmp_path, more=(), **fields):
    """Load the file of a plan after fields of its surface, and more of its object, were changed."""
    plan = gc.plan(body, 0.5, families="concurrent", limit=1)
    path = gc.save_grasps(tmp_path / "grasps.json", plan)
    document = json.loads(path.read_text())
    document["object"]["surface"].update(fields)
    document["object"].update(more)
    path.write_text(json.dumps(document))
    return gc.load_grasps(path)


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"caps": [192]}, r"caps .*below 192, got 192"),
        ({"closed": "yes"}, "closed"),
        ({"other": 1}, "other"),
    ],
)
def test_what_cannot_be_known_of_a_surface_is_refused_by_field(fields, says, tmp_path):
    with pytest.raises(gc.InputError, match=says):
        changed(capped(), tmp_path, **fields)


def test_an_open_surface_that_a_file_calls_closed_gives_no_mass(tmp_path):
    body = changed(opened(), tmp_path, closed=True).body
    assert not body.surface.closed
    with pytest.raises(gc.InputError, match="gives no mass"):
        body.mass_at(1000.0)
    assert changed(capped(), tmp_path, closed=False).body.mass_at(1000.0) == pytest.approx(0.21)
    with pytest.raises(gc.InputError, match=r"GP-MESH-OPEN: .*: 12 edges belong"):
        changed(opened(), tmp_path, {"patches": None}, closed=True)
