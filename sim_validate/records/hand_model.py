"""The fields of a hand's links, joints and shapes in a file, and the hand that they describe.

A file that holds them can be drawn without the file or the table that the hand was made from.
"""

from typing import Annotated, NotRequired

import numpy as np
from pydantic import Field
from typing_extensions import TypedDict

from grasp_core.arrays import Array
from grasp_core.hands.couplings import Coupling
from grasp_core.hands.hand import (
    MOST_CORNERS,
    MOST_FINGERS,
    MOST_LINKS,
    MOST_SHAPES,
    Fingertip,
    Hand,
    HandFinger,
    Joint,
    Link,
    LinkShape,
)
from sim_validate.records.fields import Finite

Triple = tuple[Finite, Finite, Finite]
Rotation = tuple[Triple, Triple, Triple]


class ShapeRecord(TypedDict):
    """Fields about a rounded box, in the frame of its link."""

    position_m: Triple
    rotation: Rotation
    half_sizes_m: Triple
    radius_m: Finite


class JointRecord(TypedDict):
    """Fields about a joint, in the frame of the link before it."""

    name: str
    position_m: Triple
    rotation: Rotation
    axis: Triple
    lowest_rad: Finite
    highest_rad: Finite
    torque_limit_n_m: Finite | None


class LinkRecord(TypedDict):
    """Fields about a link of a finger and the joint that moves it."""

    name: str
    joint: JointRecord
    shapes: Annotated[list[ShapeRecord], Field(max_length=MOST_SHAPES)]
    mass_kg: Finite | None
    center_of_mass_m: Triple | None


class FingerRecord(TypedDict):
    """Fields about a finger, from the palm outwards."""

    name: str
    links: Annotated[list[LinkRecord], Field(max_length=MOST_LINKS)]
    tip_center_m: Triple
    tip_radius_m: Finite
    tip_corners_m: NotRequired[Annotated[list[Triple], Field(max_length=MOST_CORNERS)]]
    tip_rounding_m: NotRequired[Finite]


class CouplingRecord(TypedDict):
    """Fields about a joint that follows another."""

    joint: str
    driver: str
    ratio: Finite
    offset_rad: Finite


class ModelRecord(TypedDict):
    """Fields about all parts of a hand."""

    palm: Annotated[list[ShapeRecord], Field(max_length=MOST_SHAPES)]
    fingers: Annotated[list[FingerRecord], Field(max_length=MOST_FINGERS)]
    ignored_pairs: list[tuple[str, str]]
    couplings: list[CouplingRecord]
    notes: list[str]


def model_record(hand: Hand) -> ModelRecord:
    """Write the parts of a hand."""
    return {
        "palm": [_shape(each) for each in hand.palm],
        "fingers": [_finger(finger) for finger in hand.fingers],
        "ignored_pairs": list(hand.ignored_pairs),
        "couplings": couplings_record(hand),
        "notes": list(hand.notes),
    }


def couplings_record(hand: Hand) -> list[CouplingRecord]:
    """Write which joints follow others."""
    return [
        {
            "joint": each.joint,
            "driver": each.driver,
            "ratio": each.ratio,
            "offset_rad": each.offset,
        }
        for each in hand.couplings
    ]


def hand_of_model(
    name: str, record: ModelRecord, sources: list[str], torque_source: str
) -> Hand:  # fmt: skip
    """Make the hand that a record describes."""
    fingers = tuple(
        HandFinger(
            each["name"],
            tuple(map(_link_of, each["links"])),
            _tip_of(each),
        )
        for each in record["fingers"]
    )  # fmt: skip
    palm = tuple(map(_shape_of, record["palm"]))
    pairs = tuple(record["ignored_pairs"])
    couplings = tuple(
        Coupling(each["joint"], each["driver"], each["ratio"], each["offset_rad"])
        for each in record["couplings"]
    )
    notes = tuple(record["notes"])
    return Hand(name, palm, fingers, tuple(sources), torque_source, pairs, couplings, notes)


def _finger(finger: HandFinger) -> FingerRecord:
    tip = finger.tip
    record: FingerRecord = {
        "name": finger.name,
        "links": [_link(link) for link in finger.links],
        "tip_center_m": _triple(tip.center),
        "tip_radius_m": tip.radius,
    }
    if tip.corners is not None:
        record["tip_corners_m"] = list(map(_triple, tip.corners))
        record["tip_rounding_m"] = tip.rounding
    return record


def _tip_of(record: FingerRecord) -> Fingertip:
    center, radius = np.array(record["tip_center_m"]), record["tip_radius_m"]
    if "tip_corners_m" not in record:
        return Fingertip(center, radius)
    corners = np.array(record["tip_corners_m"])
    return Fingertip(center, radius, corners, record.get("tip_rounding_m", 0.0))


def _shape(shape: LinkShape) -> ShapeRecord:
    return {
        "position_m": _triple(shape.position),
        "rotation": _rotation(shape.rotation),
        "half_sizes_m": _triple(shape.half_sizes),
        "radius_m": shape.radius,
    }


def _shape_of(record: ShapeRecord) -> LinkShape:
    place, turned, half = record["position_m"], record["rotation"], record["half_sizes_m"]
    return LinkShape(np.array(place), np.array(turned), np.array(half), record["radius_m"])


def _link(link: Link) -> LinkRecord:
    joint, center = link.joint, link.center_of_mass
    return {
        "name": link.name,
        "joint": {
            "name": joint.name,
            "position_m": _triple(joint.position),
            "rotation": _rotation(joint.rotation),
            "axis": _triple(joint.axis),
            "lowest_rad": joint.lowest,
            "highest_rad": joint.highest,
            "torque_limit_n_m": joint.torque_limit_n_m,
        },
        "shapes": [_shape(each) for each in link.shapes],
        "mass_kg": link.mass_kg,
        "center_of_mass_m": None if center is None else _triple(center),
    }


def _link_of(record: LinkRecord) -> Link:
    own, center = record["joint"], record["center_of_mass_m"]
    joint = Joint(
        own["name"], np.array(own["position_m"]), np.array(own["rotation"]), np.array(own["axis"]),
        own["lowest_rad"], own["highest_rad"], own["torque_limit_n_m"],
    )  # fmt: skip
    shapes = tuple(map(_shape_of, record["shapes"]))
    middle = None if center is None else np.array(center)
    return Link(record["name"], joint, shapes, record["mass_kg"], middle)


def _triple(vector: Array) -> Triple:
    x, y, z = vector.tolist()
    return x, y, z


def _rotation(rows: Array) -> Rotation:
    first, second, third = map(_triple, rows)
    return first, second, third
