"""What became of grasps on a changed part is read back as it was found."""

import json
import math

import numpy as np
import pytest

import grasp_core as gc
import scenes
import sim_validate as sv
from grasp_core.files.text_files import write_text
from sim_validate.records.transfers import transfer_from_json, transfer_to_json
from tests.changed_parts import with_face_moved, with_hole

METRES, RADIANS = 0.5e-12, math.radians(0.5e-9)
"""Half of the last digit that the file keeps of distances in millimetres and of angles in degrees;
what turns them into metres and radians adds a rounding in the sixteenth digit."""
AREA = 0.5e-15
"""Areas in square millimetres are read back to this many square metres."""
SAME = 1e-15


@pytest.fixture(scope="module")
def box():
    body = scenes.example_object("box")
    return body, gc.plan(body, 0.5, limit=12).grasps


def moved(body, _):
    return with_face_moved(body, 3, 1.37e-3)


def drilled(body, grasps):
    return with_hole(body, grasps[0].faces[0], grasps[0].positions[0], 5e-3, 4e-3)


def cut_away(body, _):
    return with_face_moved(body, 0, -0.6 * np.ptp(body.vertices @ body.faces[0].normal))


@pytest.fixture(params=[moved, drilled, cut_away], ids=lambda change: change.__name__)
def both(request, box, tmp_path):
    """A transfer as it was found, and as its file holds it."""
    body, grasps = box
    found = gc.transfer(body, request.param(body, grasps), grasps, 0.5)
    path = write_text(tmp_path / "transfer.json", transfer_to_json(found))
    return found, sv.load_transfer(path)


def test_grasps_are_as_they_were_found(both):
    found, read = both
    assert len(read) == len(found.grasps) == 12
    for there, here in zip(found.grasps, read, strict=True):
        assert here is read[there.old.id]
        assert here.new_id == (None if there.grasp is None else there.grasp.id)
        assert (here.status, here.reason) == (there.status, there.reason)
        assert (here.before, here.after) == (there.before, there.after)
        for contact, saved in zip(there.contacts, here.contacts, strict=True):
            assert saved.contact == contact.contact
            assert (saved.finger, saved.old_face) == (contact.finger, contact.old_face)
            assert saved.new_face == contact.new_face
            assert saved.distance == pytest.approx(contact.distance, rel=SAME, abs=METRES)
            assert saved.turn == pytest.approx(contact.turn, rel=SAME, abs=RADIANS)
    assert [read.count(status) for status in ("same", "better", "worse", "gone")] == [
        found.count(status) for status in ("same", "better", "worse", "gone")
    ]


def test_faces_and_rules_are_as_they_were_found(both):
    found, read = both
    assert read.old_sha256 == found.old.content_sha256
    assert read.new_sha256 == found.new.content_sha256
    assert (read.friction, read.distance, read.added) == (0.5, found.distance, found.added)
    assert read.angle == pytest.approx(found.angle, rel=SAME, abs=RADIANS)
    assert read.faces_in_words == found.faces_in_words
    for there, here in zip(found.faces, read.faces, strict=True):
        assert (here.old, here.new, here.moved) == (there.old, there.new, there.moved)
        assert (here.normal, here.center) == (there.normal, there.center)
        assert here.likely == there.likely
        assert here.likely_turn == pytest.approx(there.likely_turn, rel=SAME, abs=RADIANS)
        assert here.distance == pytest.approx(there.distance, rel=SAME, abs=METRES)
        assert here.turn == pytest.approx(there.turn, rel=SAME, abs=RADIANS)
        assert here.old_area == pytest.approx(there.old_area, rel=SAME, abs=AREA)
        assert here.new_area == pytest.approx(there.new_area, rel=SAME, abs=AREA)


def test_the_changes_reach_every_ending(box):
    """The three parts above show contacts with and without a place, and three statuses."""
    body, grasps = box
    texts = [transfer_to_json(gc.transfer(body, change(body, grasps), grasps, 0.5))
             for change in (moved, drilled, cut_away)]  # fmt: skip
    read = [transfer_from_json(text) for text in texts]
    assert {each.status for found in read for each in found} >= {"same", "better", "gone"}
    lost = [c for found in read for each in found for c in each.contacts if c.contact is None]
    assert 0 < len(lost) < 12 * 4 * len(read)


def test_it_is_a_sequence_and_a_value(both):
    _, read = both
    assert read[2:4].grasps == read.grasps[2:4]
    assert read[0].id in read
    assert str(read).startswith("SavedTransfer(of 12 grasps ")
    assert str(read[0]).startswith(f"SavedCarriedGrasp({read[0].id} -> ")


CHANGES = {
    "another schema": (lambda d: d.update(schema=2), "schema"),
    "an unknown field": (lambda d: d.update(more=1), "more: unknown key"),
    "a wrong count": (lambda d: d["summary"].update(same=99), r"summary\.same: expected \d+, as"),
    "lost contacts": (lambda d: d["summary"].update(contacts_lost=7), r"summary\.contacts_lost"),
    "gone with an id": (lambda d: d["grasps"][0].update(status="gone"), r"grasps\[0\]\.new_id"),
    "half a place": (
        lambda d: d["grasps"][1]["contacts"][2].update(normal=None),
        r"grasps\[1\]\.contacts\[2\]: new_face, position_m and normal: expected all three",
    ),
    "no distance": (
        lambda d: d["grasps"][0]["contacts"][1].update(moved_mm=None),
        r"grasps\[0\]\.contacts\[1\]\.moved_mm: null is not allowed beside a place",
    ),
    "a normal of length 2": (
        lambda d: d["grasps"][0]["contacts"][3].update(normal=[0.0, 0.0, 2.0]),
        r"grasps\[0\]\.contacts\[3\]: normal",
    ),
    "three contacts": (lambda d: d["grasps"][0]["contacts"].pop(), r"grasps\[0\]\.contacts: exp"),
    "a number as text": (lambda d: d.update(friction="0.5"), "friction: expected a number"),
}


@pytest.mark.parametrize("name", CHANGES)
def test_a_file_that_contradicts_itself_is_refused_at_its_field(box, tmp_path, name):
    body, grasps = box
    document = json.loads(transfer_to_json(gc.transfer(body, moved(body, grasps), grasps[:3])))
    change, said = CHANGES[name]
    change(document)
    path = write_text(tmp_path / "transfer.json", json.dumps(document))
    with pytest.raises(gc.InputError, match=rf"transfer\.json: .*{said}"):
        sv.load_transfer(path)


def test_other_files_are_refused(tmp_path):
    with pytest.raises(gc.InputError, match="cannot be read"):
        sv.load_transfer(tmp_path / "none.json")
    path = write_text(tmp_path / "a.json", "[]")
    with pytest.raises(gc.InputError, match=r"a\.json: a transfer\.json must hold one JSON object"):
        sv.load_transfer(path)
