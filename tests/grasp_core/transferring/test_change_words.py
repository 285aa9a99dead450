"""What is said of changed faces, for changes whose words can be written down beforehand."""

import math

import numpy as np
import pytest
import trimesh

import grasp_core as gc
from grasp_core.transferring.change_words import MOST_NAMED, common_shift, in_words
from grasp_core.transferring.face_changes import added_faces, face_changes
from grasp_core.transferring.face_places import face_in_words, place_in_words
from grasp_core.transferring.like_faces import likeness
from scenes.example_objects import example_object
from tests.changed_parts import with_chamfer, with_face_moved, with_hole


def changes_of(old, new):
    found = face_changes(old, new, likeness(old, None, 5.0))
    return found, added_faces(found, new)


def shifted(body, by):
    return gc.Polyhedron.from_mesh(body.vertices + by, body.triangles, faces="planar")


def test_a_face_is_found_by_the_way_it_faces_and_by_its_place():
    """Normals point into the part, so a face that faces +x has the normal -x."""
    assert place_in_words((-1.0, 0.0, 0.0), (0.06, 0.01, 0.02)) == "facing +x at x = 60 mm"
    assert place_in_words((0.0, 1.0, 0.0), (0.06, -0.0125, 0.02)) == "facing -y at y = -12.5 mm"
    assert place_in_words((0.0, -6e-9, -1.0), (0.0, 0.0, 3e-12)) == "facing +z at z = 0 mm"
    slope = math.sqrt(0.5)
    said = place_in_words((-slope, 0.0, -slope), (0.01, 0.0, 0.0205))
    assert said == "facing (0.71, 0, 0.71) around (10, 0, 20.5) mm"


def test_each_face_of_a_box_faces_another_way():
    box = example_object("box")
    said = [face_in_words(face) for face in box.faces]
    assert sorted(text[7:9] for text in said) == ["+x", "+y", "+z", "-x", "-y", "-z"]
    for face, text in zip(box.faces, said, strict=True):
        axis = "xyz".index(text[8])
        assert text.endswith(f"{text[8]} = {1e3 * face.centroid[axis]:g} mm")


@pytest.mark.parametrize("by_mm", [(1.0, 0.0, 0.0), (0.5, -0.25, 2.0)])
def test_a_shift_of_the_whole_part_is_said_as_one(by_mm):
    for name in ("box", "wedge", "l-bracket"):
        body = example_object(name)
        found, added = changes_of(body, shifted(body, 1e-3 * np.array(by_mm)))
        shift = common_shift(found, added)
        np.testing.assert_allclose(shift, 1e-3 * np.array(by_mm), atol=1e-12)
        way = ", ".join(f"{each:g}" for each in by_mm)
        said = in_words(found, added)
        assert said.startswith(f"it is as if the whole part were shifted by ({way}) mm; face")


def test_one_moved_face_or_a_scaled_part_is_no_shift():
    body = example_object("box")
    larger = gc.Polyhedron.from_mesh(1.02 * body.vertices, body.triangles, faces="planar")
    for new in (body, with_face_moved(body, 3, 1e-3), larger):
        found, added = changes_of(body, new)
        assert common_shift(found, added) is None
        assert "shifted" not in in_words(found, added)


def test_a_pocket_and_a_chamfer_are_so_many_new_faces():
    body = example_object("box")
    round_hole = with_hole(body, 3, body.faces[3].centroid, 4e-3, depth=5e-3)
    said = in_words(*changes_of(body, round_hole))
    assert said == "face 3 (facing +z at z = 25 mm) became smaller; 25 new faces"
    cut = in_words(*changes_of(body, with_chamfer(body, 3, 0, 4e-3)))
    assert cut.startswith("faces 0, ")
    assert cut.endswith(" became smaller; 1 new face")


def test_a_face_that_turned_too_far_is_said_to_have_turned():
    body = example_object("box")
    vertices = body.vertices.copy()
    top = np.isclose(vertices[:, 2], vertices[:, 2].max())
    vertices[top, 2] += vertices[top, 0] * math.tan(math.radians(20.0))
    new = gc.Polyhedron.from_mesh(vertices, body.triangles, faces="planar")
    found, added = changes_of(body, new)
    turned = found[3]
    assert (turned.new, turned.likely in added) == (None, True)
    assert turned.likely_turn == pytest.approx(math.radians(20.0))
    said = in_words(found, added)
    assert "(facing +z at z = 25 mm) turned 20.00 deg, too far to be the same face" in said
    assert "gone" not in said
    assert "new face" not in said


def test_a_face_that_was_cut_off_is_gone():
    """A hexagonal prism loses a side to a cut that leaves nothing within 45 deg of it."""
    body = gc.Polyhedron.from_mesh(*_prism(6), faces="planar")
    kept = [face for face in range(8) if abs(body.normals[face][2]) < 0.5]
    gone = kept[0]
    new = gc.Polyhedron.from_mesh(*_without(body, body.normals[gone]), faces="planar")
    said = str(changes_of(body, new)[0][gone])
    assert said.startswith(f"face {gone} (facing ")
    assert said.endswith(") is gone")


def _prism(sides):
    turn = 2.0 * np.pi * np.arange(sides) / sides
    ring = 0.03 * np.column_stack([np.cos(turn), np.sin(turn), np.zeros(sides)])
    hull = trimesh.convex.convex_hull(np.vstack([ring, ring + np.array([0.0, 0.0, 0.04])]))
    return hull.vertices, hull.faces


def _without(body, inward):
    """The prism grown to a point on one side: the two neighbours of a side meet before it."""
    across = body.vertices @ -inward
    outer = across > across.max() - 1e-9
    points = body.vertices.copy()
    along = np.cross(inward, [0.0, 0.0, 1.0])
    middle = points[outer] - np.outer(points[outer] @ along, along)
    grown = middle + np.outer(np.full(len(middle), 0.015 * math.sqrt(3.0)), -inward)
    hull = trimesh.convex.convex_hull(np.vstack([points[~outer], points[outer], grown]))
    return hull.vertices, hull.faces


def test_up_to_twelve_faces_are_listed():
    turned = gc.Polyhedron.from_mesh(*_prism(10), faces="planar")
    flat = [face for face in range(12) if abs(turned.normals[face][2]) > 0.5]
    top = max(flat, key=lambda face: turned.faces[face].centroid[2])
    said = in_words(*changes_of(turned, with_face_moved(turned, top, 1e-3)))
    assert said.count(", ") == 9
    assert "more" not in said
    fine = gc.Polyhedron.from_mesh(*_prism(16), faces="planar")
    flat = [face for face in range(18) if abs(fine.normals[face][2]) > 0.5]
    top = max(flat, key=lambda face: fine.faces[face].centroid[2])
    said = in_words(*changes_of(fine, with_face_moved(fine, top, 1e-3)))
    assert f" and {16 - MOST_NAMED} more became larger" in said


def test_faces_are_called_by_the_numbers_that_are_given():
    body = example_object("box")
    found, added = changes_of(body, with_face_moved(body, 3, 1e-3))
    numbers = {0: 0, 1: 1, 3: 7, 4: 4}
    assert in_words(found, added, numbers) == (
        "face 7 (facing +z at z = 25 mm), face 3 of the changed part, moved 1.00 mm outward; faces "
        "0, 1, 4 and 1 more became larger"
    )
    del numbers[3]
    assert in_words(found, added, numbers).startswith("a newer face (facing +z at z = 25 mm) moved")
