"""Readers of data files as targets, each with another reading of the same bytes."""

import json
from functools import cache
from typing import Any

import grasp_core as gc
from grasp_core.contact_sets import Overrides, contact_sets_from_json
from grasp_core.records import SavedGrasps, grasps_from_json, plan_to_json
from scenes.objects import example_object
from tests.fuzzing.targets import Target


def text_of(data: bytes) -> str:
    """What `read_text` makes of a file's bytes."""
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise gc.InputError("not UTF-8 text") from error


@cache
def _grasps() -> bytes:
    body = example_object("tetrahedron")
    return plan_to_json(body, gc.plan(body, 0.5, limit=1)).encode()


def _same_grasps(data: bytes, found: SavedGrasps) -> None:
    stated = json.loads(data)
    assert stated["friction"] == found.friction
    assert stated["seed"] == found.seed
    assert stated["object"]["name"] == found.body.name
    for one, other in zip(stated["grasps"], found.grasps, strict=True):
        assert one["id"] == other.id
        assert one["faces"] == list(other.faces)
        assert [each["position_m"] for each in one["contacts"]] == other.positions.tolist()


CONTACTS = {
    "contacts": [
        {"position_m": [1.0, 0, 0], "normal": [-1.0, 0, 0], "friction": 0.5},
        {"position_m": [-1.0, 0, 0], "normal": [1.0, 0, 0]},
        {"position_m": [0, 1.0, 0], "normal": [0, -1.0, 0]},
    ],
    "friction": 0.4, "center_m": [0, 0, 0.1], "torque_scale_m": 1.0,
}  # fmt: skip


def _contacts_seeds() -> list[bytes]:
    several = {"grasps": [{"id": "a", "contacts": CONTACTS["contacts"]}], "friction": 0.3}
    return [json.dumps(each).encode() for each in (CONTACTS, several)]


def _same_contacts(data: bytes, found: Any) -> None:
    stated = json.loads(data)
    if "schema" in stated:
        return
    listed = stated.get("grasps", [stated])
    assert len(listed) == len(found)
    for one, other in zip(listed, found, strict=True):
        assert [each["position_m"] for each in one["contacts"]] == other.positions.tolist()
        common = stated.get("friction")
        assert [each.get("friction", common) for each in one["contacts"]] == other.friction.tolist()


TARGETS = (
    Target(
        "grasps",
        lambda data: grasps_from_json(text_of(data)),
        lambda: [_grasps()],
        _same_grasps,
        "json",
    ),
    Target(
        "contacts",
        lambda data: contact_sets_from_json(text_of(data), Overrides()),
        _contacts_seeds,
        _same_contacts,
        "json",
    ),
)
