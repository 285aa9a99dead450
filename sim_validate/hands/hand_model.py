"""The parts of a hand in a file, and the hand that they describe.

A file that holds them can be drawn without the file or the table that the hand was made from. Keys
are the names of the parts' fields, with their units; the parts themselves check their values.
"""

from collections.abc import Collection, Mapping
from typing import Any, cast

import numpy as np

from grasp_core.errors import InputError, about
from grasp_core.files.json_text import place, shown
from grasp_core.hands.couplings import Coupling
from grasp_core.hands.hand import Fingertip, Hand, HandFinger, Joint, Link, LinkShape

KEYS: Mapping[type, Mapping[str, str]] = {
    LinkShape: {
        "position": "position_m", "rotation": "rotation", "half_sizes": "half_sizes_m",
        "radius": "radius_m",
    },
    Joint: {
        "name": "name", "position": "position_m", "rotation": "rotation", "axis": "axis",
        "lowest": "lowest_rad", "highest": "highest_rad", "torque_limit_n_m": "torque_limit_n_m",
    },
    Link: {
        "name": "name", "joint": "joint", "shapes": "shapes", "mass_kg": "mass_kg",
        "center_of_mass": "center_of_mass_m",
    },
    Coupling: {"joint": "joint", "driver": "driver", "ratio": "ratio", "offset": "offset_rad"},
}  # fmt: skip
"""Key of each field of a part."""
TIP = {
    "center": "tip_center_m", "radius": "tip_radius_m", "corners": "tip_corners_m",
    "rounding": "tip_rounding_m",
}  # fmt: skip
"""Keys of a fingertip, which stand beside those of its finger; a ball has only the first two."""
BALL, BLOCK = [*TIP.values()][:2], [*TIP.values()]
MODEL = ("palm", "fingers", "ignored_pairs", "couplings", "notes")


def model_record(hand: Hand) -> dict[str, Any]:
    """Write the parts of a hand."""
    fingers = [
        {"name": each.name, "links": _plain(each.links), **_tip_record(each.tip)}
        for each in hand.fingers
    ]
    return {name: _plain(getattr(hand, name)) for name in MODEL} | {"fingers": fingers}


def hand_of_model(name: str, record: object, sources: list[str], torque_source: str) -> Hand:
    """Make the hand that a record describes."""
    model = _keyed(record, MODEL, "model")
    fingers = tuple(
        _finger(each, f"fingers[{number}]")
        for number, each in enumerate(_listed(model["fingers"], "fingers"))
    )
    pairs = [_listed(each, "ignored_pairs") for each in _listed(model["ignored_pairs"], "pairs")]
    return Hand(
        name, _parts(LinkShape, model["palm"], "palm"), fingers, tuple(sources), torque_source,
        tuple(map(tuple, pairs)), _parts(Coupling, model["couplings"], "couplings"),
        tuple(_listed(model["notes"], "notes")),
    )  # fmt: skip


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, tuple):
        return [_plain(part) for part in cast("tuple[Any, ...]", value)]
    keys = KEYS.get(value.__class__)
    if keys is None:
        return value
    return {key: _plain(getattr(value, name)) for name, key in keys.items()}


def _tip_record(tip: Fingertip) -> dict[str, Any]:
    written = {key: _plain(getattr(tip, name)) for name, key in TIP.items()}
    return {key: written[key] for key in (BALL if tip.corners is None else BLOCK)}


def _finger(record: object, where: str) -> HandFinger:
    block = "tip_corners_m" in _object(record, where)
    given = _keyed(record, ["name", "links", *(BLOCK if block else BALL)], where)
    with about(where):
        tip = Fingertip(**{name: _value(given[key]) for name, key in TIP.items() if key in given})
        return HandFinger(given["name"], _parts(Link, given["links"], "links"), tip)


def _parts(kind: type[Any], record: object, where: str) -> tuple[Any, ...]:
    return tuple(
        _part(kind, each, f"{where}[{number}]")
        for number, each in enumerate(_listed(record, where))
    )


def _part(kind: type[Any], record: object, where: str) -> Any:
    given = _keyed(record, KEYS[kind].values(), where)
    values = {name: _value(given[key]) for name, key in KEYS[kind].items()}
    with about(where):
        if kind is Link:
            values["joint"] = _part(Joint, given["joint"], "joint")
            values["shapes"] = _parts(LinkShape, given["shapes"], "shapes")
        return kind(**values)


def _value(value: object) -> Any:
    """Return a value with whole numbers as floats, which a file may hold for them."""
    return float(value) if type(value) is int else value


def _listed(record: object, where: str) -> list[Any]:
    if not isinstance(record, list):
        raise InputError(f"{where}: expected a list, got {shown(record)}")
    return cast("list[Any]", record)


def _object(record: object, where: str) -> dict[str, Any]:
    if not isinstance(record, dict):
        raise InputError(f"{where}: expected an object, got {shown(record)}")
    return cast("dict[str, Any]", record)


def _keyed(record: object, keys: Collection[str], where: str) -> dict[str, Any]:
    """Return a record that has certain keys and no others."""
    given = _object(record, where)
    if odd := sorted(given.keys() ^ set(keys)):
        fault = "unknown" if odd[0] in given else "missing"
        raise InputError(f"{where}: {place(odd[:1])}: {fault} key; keys are {', '.join(keys)}")
    return given
