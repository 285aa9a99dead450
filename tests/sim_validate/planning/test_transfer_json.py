"""`transfer.json` says what became of grasps and faces on a changed part, with finite numbers."""

import json

import numpy as np
import pytest

import grasp_core as gc
import scenes
from sim_validate.planning.transfer import TransferFile
from tests.changed_parts import with_face_moved, with_hole


def moved(body, _):
    return with_face_moved(body, 3, 1.37e-3)


def drilled(body, grasps):
    return with_hole(body, grasps[0].faces[0], grasps[0].positions[0], 5e-3, 4e-3)


def cut_away(body, _):
    return with_face_moved(body, 0, -0.6 * np.ptp(body.vertices @ body.faces[0].normal))


@pytest.mark.parametrize("change", [moved, drilled, cut_away])
def test_the_file_says_what_was_found(change):
    body = scenes.example_object("box")
    grasps = gc.plan(body, 0.5, limit=12).grasps
    found = gc.transfer(body, change(body, grasps), grasps, 0.5)
    record = json.loads(TransferFile.of(found).text(), parse_constant=pytest.fail)
    assert record["old"]["content_sha256"] == found.old.content_sha256
    assert record["new"]["content_sha256"] == found.new.content_sha256
    lost = 0
    for told, there in zip(record["grasps"], found.grasps, strict=True):
        assert told["id"] == there.old.id
        assert told["new_id"] == (None if there.grasp is None else there.grasp.id)
        assert (told["status"], told["reason"]) == (there.status, there.reason)
        assert told["before"]["ferrari_canny"] == list(there.before.ferrari_canny)
        for contact, each in zip(told["contacts"], there.contacts, strict=True):
            lost += each.contact is None
            assert contact["new_face"] == each.new_face
            assert (contact["contact"] is None) == (each.contact is None)
            if each.contact is not None:
                assert contact["contact"]["position_m"] == each.contact.position.tolist()
                assert contact["moved_m"] == each.distance
    assert record["summary"]["contacts_lost"] == lost
    for told, there in zip(record["faces"], found.faces, strict=True):
        assert (told["old"], told["new"], told["moved"]) == (there.old, there.new, there.moved)
        assert (told["turned_rad"], told["new_area_m2"]) == (there.turn, there.new_area)
