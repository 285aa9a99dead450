"""Grasps carried over to parts that were changed by known motions, holes and chamfers."""

import dataclasses
import math

import numpy as np
import pytest
import trimesh

import grasp_core as gc
from grasp_core.objects.on_faces import check_on_faces
from grasp_core.planning.grasps_json import grasps_from_json, plan_to_json
from grasp_core.transferring.part_comparison import face_changes, likeness
from grasp_core.transferring.transfer import (
    FRICTION_BAND,
    QUALITY_BAND,
    compared,
    fitting_lengths,
    fitting_unit,
)
from scenes.example_objects import example_object
from tests.bad_input.of_threemf import mesh, model, object_, threemf
from tests.changed_parts import (
    is_on_surface,
    nearest_like,
    with_chamfer,
    with_face_moved,
    with_hole,
)

FRICTION = 0.5


def planned(name, limit=20):
    body = example_object(name)
    return body, gc.plan(body, FRICTION, limit=limit).grasps


@pytest.fixture(scope="module")
def box():
    return planned("box")


@pytest.mark.parametrize("times", [1.0, 25.4, 0.3])
def test_a_changed_file_that_states_its_unit_is_in_no_other(times, tmp_path):
    """However much larger the part is than it was, and however well another unit fits."""
    body, path = example_object("box"), tmp_path / "box.3mf"
    points = times * body.vertices / 0.0254
    path.write_bytes(threemf(model(object_(mesh(points, body.triangles)), more='unit="inch"')))
    assert fitting_unit(path, body) == "in"
    assert fitting_lengths(path, body) == ("in", pytest.approx(1.0 / times))


def scaled(body, by):
    return gc.Polyhedron.from_mesh(by * body.vertices, body.triangles, faces="planar")


def test_on_the_same_part_every_grasp_is_the_same(box):
    body, grasps = box
    found = gc.transfer(body, body, grasps, FRICTION)
    assert [each.status for each in found.grasps] == ["same"] * len(grasps) != []
    assert [each.grasp.id for each in found.grasps] == [grasp.id for grasp in grasps]
    assert found.faces_in_words == "no face moved"
    assert found.added == ()
    for each in found.grasps:
        np.testing.assert_allclose(each.grasp.positions, each.old.positions, atol=1e-15)
        np.testing.assert_array_equal(each.grasp.normals, each.old.normals)


def test_a_face_that_moved_too_far_is_named_with_finger_face_and_distance(box):
    body, grasps = box
    found = gc.transfer(body, with_face_moved(body, 3, 2e-3), grasps, FRICTION, distance=1.5e-3)
    gone = [each for each in found.grasps if 3 in each.old.faces]
    assert 0 < len(gone) < len(grasps)
    for each in gone:
        finger = each.old.faces.index(3)
        assert each.status == "gone"
        assert each.grasp is None
        assert each.after is None
        lost = each.contacts[finger]
        assert lost.contact is None
        assert lost.distance == pytest.approx(2e-3, abs=1e-12)
        assert each.reason == (
            f"finger {finger} has lost face 3: the nearest face like it is 2.00 mm away, "
            "distance_m allows 1.50 mm"
        )
    assert "face 3 moved 2.00 mm outward" in found.faces_in_words
    exactly = gc.transfer(body, with_face_moved(body, 3, 2e-3), grasps, FRICTION, distance=2e-3)
    assert not exactly.count("gone")


def test_a_face_that_turned_too_far_is_lost():
    """A wedge of the box's top, cut off with a slope of just below and just above the angle."""
    body, grasps = planned("box")
    for slope, lost in ((4.9, False), (5.1, True)):
        vertices = body.vertices.copy()
        top = np.isclose(vertices[:, 2], vertices[:, 2].max())
        vertices[top, 2] += vertices[top, 0] * math.tan(math.radians(slope))
        new = gc.Polyhedron.from_mesh(vertices, body.triangles, faces="planar")
        found = gc.transfer(body, new, grasps, FRICTION, distance=5e-3)
        on_top = [each for each in found.grasps if 3 in each.old.faces]
        assert on_top
        assert all((each.contacts[each.old.faces.index(3)].contact is None) is lost
                   for each in on_top)  # fmt: skip
        if lost:
            assert "no face is within 5 deg of it" in on_top[0].reason
            turned = found.faces[3]
            assert (turned.new, turned.likely in found.added) == (None, True)
            assert turned.likely_turn == pytest.approx(math.radians(slope))
            assert f"turned {slope:.2f} deg, too far to be the same face" in found.faces_in_words
            assert "new face" not in found.faces_in_words
        else:
            assert f"turned {slope:.2f} deg" in found.faces_in_words


def test_nothing_is_found_through_a_thin_plate():
    """A plate of 2 mm lowered by 1.5 mm.

    Its new upper side is half a millimetre above its old lower side, nearer than any like face, but
    has the opposite normal.
    """
    box = trimesh.creation.box([0.1, 0.08, 0.002])
    body = gc.Polyhedron.from_mesh(box.vertices, box.faces)
    new = gc.Polyhedron.from_mesh(body.vertices - [0.0, 0.0, 0.0015], body.triangles)
    flat = {index for index in range(6) if abs(body.normals[index][2]) > 0.5}
    grasps = [grasp for grasp in gc.plan(body, 1.0).grasps if flat & {*grasp.faces}]
    found = gc.transfer(body, new, grasps, 1.0, distance=0.001)
    assert found.count("gone") == len(grasps) > 0
    for each in found.grasps:
        for contact in each.contacts:
            if contact.old_face in flat:
                assert contact.contact is None
                assert contact.distance == pytest.approx(0.0015, abs=1e-12)
    assert gc.transfer(body, new, grasps, 1.0, distance=0.0015).count("gone") == 0


CHANGES = [
    ("prism", "moved", -2e-3), ("l-bracket", "hole", 2e-3), ("box", "chamfer", 6e-3),
    pytest.param("hex-nut", "moved", 5e-3, marks=pytest.mark.slow),
]  # fmt: skip


def changed(body, grasp, kind, size):
    face = grasp.faces[0]
    if kind == "moved":
        return with_face_moved(body, face, size)
    if kind == "hole":
        return with_hole(body, face, grasp.positions[0] + 0.3 * size, size, depth=size)
    for other in range(len(body.faces)):
        try:
            return with_chamfer(body, face, other, size)
        except AssertionError:
            continue
    raise AssertionError("no edge")


@pytest.mark.parametrize(("name", "kind", "size"), CHANGES)
def test_carried_contacts_are_nearest_on_the_new_surface_and_judged_as_by_hand(name, kind, size):
    """Measured on all triangles by trimesh: on the surface, its normal, and the nearest."""
    body, grasps = planned(name, limit=8)
    new = changed(body, grasps[0], kind, size)
    found = gc.transfer(body, new, grasps, FRICTION)
    if kind == "moved":
        way = "outward" if size > 0.0 else "inward"
        assert f"moved {1e3 * abs(size):.2f} mm {way}" in found.faces_in_words
    placed = 0
    for each in found.grasps:
        for contact, before in zip(each.contacts, each.old.contacts, strict=True):
            nearest = nearest_like(new, before.position, before.normal, 5.0)
            assert (contact.contact is not None) == (nearest <= found.distance + 1e-9 * body.radius)
            if contact.contact is None:
                assert contact.distance == pytest.approx(nearest, abs=1e-9 * body.radius)
                continue
            placed += 1
            assert is_on_surface(new, contact.contact)
            moved = np.linalg.norm(contact.contact.position - before.position)
            assert moved == pytest.approx(nearest, abs=1e-9 * body.radius)
            assert moved == pytest.approx(contact.distance, abs=1e-12)
            angle = math.acos(min(float(contact.contact.normal @ before.normal), 1.0))
            assert angle <= math.radians(5.0) + 1e-7
        if each.grasp is not None:
            check_on_faces(new, each.grasp)
        if each.after is not None:
            judged_by_hand(new, each)
    assert placed >= 16
    assert sum(each.after is not None for each in found.grasps) >= 2


def judged_by_hand(new, each):
    points = np.array([contact.contact.position for contact in each.contacts])
    normals = np.array([contact.contact.normal for contact in each.contacts])
    by_hand = gc.force_closure(points, normals, FRICTION)
    assert by_hand.closed == (each.grasp is not None)
    critical = gc.critical_friction(points, normals)
    assert each.after.critical_friction == pytest.approx(critical, abs=1e-7)
    assert each.after.closure_margin == pytest.approx(by_hand.margin, abs=1e-9)
    if by_hand.closed:
        quality = gc.ferrari_canny(points, normals, FRICTION, center=new.center_of_mass,
                                   torque_scale=new.radius)  # fmt: skip
        assert each.after.ferrari_canny == (quality.lower, quality.upper)


def test_the_carried_grasps_of_a_file_can_be_read_back():
    """Witnesses whose forces all meet become skew, as the family of the file demands."""
    read = 0
    for name in ("octahedron", "box"):
        body, grasps = planned(name, limit=10)
        plan = gc.plan(body, FRICTION, limit=10)
        found = gc.transfer(body, scaled(body, 1.001), grasps, FRICTION)
        text = plan_to_json(found.new, dataclasses.replace(plan, grasps=found.carried))
        saved = grasps_from_json(text)
        assert [grasp.id for grasp in saved.grasps] == [grasp.id for grasp in found.carried]
        for grasp in saved.grasps:
            assert gc.classify_lines(grasp.witness.points, grasp.witness.forces) == "regulus"
            read += 1
    assert read >= 15


def test_a_grasp_that_loses_force_closure_is_gone_and_says_what_it_would_need(box):
    body, grasps = box
    low = min(each.critical_friction for each in grasps)
    found = gc.transfer(body, body, grasps, 0.5 * low)
    assert found.count("gone") == len(grasps)
    for each in found.grasps:
        assert each.before.closure_margin <= 0.0
        assert f"above {each.after.critical_friction:.4f} they are" in each.reason


def test_new_ids_name_the_new_faces_and_are_unique():
    """The same box with its triangles turned round, so that faces get other numbers."""
    body, grasps = planned("box", limit=30)
    turned = gc.Polyhedron.from_mesh(body.vertices[::-1], len(body.vertices) - 1 - body.triangles,
                                     faces="planar")  # fmt: skip
    new = with_hole(turned, 0, turned.faces[0].centroid, 1e-3, 2e-3)
    named = dataclasses.replace(grasps[0], id="mine")
    found = gc.transfer(body, new, [*grasps, named], FRICTION)
    ids = [each.grasp.id for each in found.grasps if each.grasp is not None]
    assert len(set(ids)) == len(ids) >= 10
    assert ids[-1] == "mine"
    renamed = 0
    for each in found.grasps[:-1]:
        if each.grasp is not None:
            faces = [contact.new_face for contact in each.contacts]
            assert each.grasp.id.split("-")[1:5] == [str(face) for face in faces]
            assert list(each.grasp.faces) == faces
            renamed += each.grasp.id != each.old.id
    assert renamed
    twice = gc.transfer(body, body, [grasps[0], grasps[0]], FRICTION).carried
    assert [grasp.id for grasp in twice] == [grasps[0].id, f"{grasps[0].id}-2"]


def test_fingers_that_cannot_reach_a_carried_contact_are_named():
    """A finger as thick as the bracket's notch is wide cannot come to the faces of the notch."""
    body, finger = example_object("l-bracket"), gc.Finger(0.003, 0.03)
    grasps = gc.plan(body, FRICTION, finger=finger, families="concurrent").grasps
    found = gc.transfer(body, body, grasps, FRICTION, finger=finger)
    assert found.count("same") == len(grasps) > 5
    for each in found.grasps:
        np.testing.assert_allclose(each.grasp.approach_directions, each.old.approach_directions,
                                   atol=1e-9)  # fmt: skip
    thick = gc.transfer(body, body, grasps, FRICTION, finger=gc.Finger(0.02, 0.03))
    lost = [each for each in thick.grasps if each.status == "gone"]
    assert lost
    assert all(each.reason.startswith("out of reach: finger") for each in lost)
    assert all(
        each.after == one.after for each, one in zip(thick.grasps, found.grasps, strict=True)
    )


def test_curved_parts_and_grasps_of_other_parts_are_refused(box):
    body, grasps = box
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.05)
    curved = gc.Polyhedron.from_mesh(ball.vertices, ball.faces, faces="patches")
    for old, new in ((curved, body), (body, curved)):
        with pytest.raises(gc.InputError, match="expected an object with planar faces"):
            gc.transfer(old, new, grasps, FRICTION)
    with pytest.raises(gc.InputError, match="use a grasp of this object"):
        gc.transfer(scaled(body, 2.0), body, grasps, FRICTION)


def test_bands_are_where_they_are_said_to_be():
    """Just inside a band is the same; just outside of it better or worse, and worse prevails."""
    plain = gc.GraspFigures(0.1, 0.2, (0.1, 0.1001))

    def status(friction=0.2, quality=0.1):
        new = gc.GraspFigures(0.1, friction, (quality, quality))
        return compared(plain, new, FRICTION)[0]

    step = FRICTION_BAND * FRICTION
    share = QUALITY_BAND * 0.1
    near, far = 0.99, 1.01
    assert status(0.2 + near * step) == status(0.2 - near * step) == "same"
    assert status(quality=0.1 + near * share) == status(quality=0.1 - near * share) == "same"
    assert status(0.2 + far * step) == status(quality=0.1 - far * share) == "worse"
    assert status(0.2 - far * step) == status(quality=0.1 + far * share) == "better"
    assert status(0.2 - 2.0 * step, 0.1 - 2.0 * share) == "worse"


def test_a_part_written_with_six_decimals_has_not_moved():
    """Its coordinates are rounded by far more than a millionth of its size."""
    large = example_object("random-8-3")
    points, triangles = 0.2 * large.vertices, large.triangles
    exact = gc.Polyhedron.from_mesh(points, triangles)
    rounded = gc.Polyhedron.from_mesh(points.round(6), triangles, flatness_m=4e-6)
    changes = face_changes(exact, rounded, likeness(exact, None, 10.0))
    assert max(abs(change.distance) for change in changes) > 1e-6 * exact.radius
    assert [change.new for change in changes] == list(range(len(exact.faces)))
    assert not any(change.moved for change in changes)
