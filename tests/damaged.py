"""Damages documents so that no reader may take them, for the tests of every kind of file."""

import copy
import json
import random
from dataclasses import MISSING, is_dataclass
from typing import get_args

import grasp_core as gc
from grasp_core.files.records import entries

EXTRA = "colour"
"""A key that no file has."""
WRONG = {bool: "yes", int: "1", float: "1", str: 1.5, list: {EXTRA: 1}, dict: [1], type(None): [{}]}
"""A value of another type for each type of value, which no field takes for it."""
NUMBERS = {"true": True, "too large": 1e300, "not finite": float("nan")}
"""What no number of a file may be."""


def damaged(document, count):
    """Yield (what, place, document): copies with one fault each, every field with every fault.

    `place` holds the keys and list places that lead to the fault. Of lists, one place is damaged.
    If there are more faults than `count`, some are left out by chance.
    """
    rng = random.Random(0)  # noqa: S311 - nothing is kept secret
    everywhere = dict[tuple, list[tuple]]()
    for place in places(document, ()):
        everywhere.setdefault(tuple(k for k in place if isinstance(k, str)), []).append(place)
    faults = []
    for same in everywhere.values():
        for what in ("missing", "unknown key", "wrong type", *NUMBERS):
            fitting = [place for place in same if _fits(what, document, place)]
            faults += [(what, rng.choice(fitting))] if fitting else []
    for what, place in rng.sample(faults, min(count, len(faults))):
        changed = copy.deepcopy(document)
        holder, last = value_at(changed, place[:-1]), place[-1]
        if what == "missing":
            del holder[last]
        elif what == "unknown key":
            place = (*place[:-1], EXTRA)
            holder[EXTRA] = 1
        else:
            holder[last] = WRONG[type(holder[last])] if what == "wrong type" else NUMBERS[what]
        yield what, place, changed


def places(value, place):
    """Yield where the values of a document are, at any depth."""
    items = value.items() if isinstance(value, dict) else enumerate(value)
    for key, item in items:
        yield (*place, key)
        if isinstance(item, dict | list):
            yield from places(item, (*place, key))


def _fits(what, document, place):
    if what in {"missing", "unknown key"}:
        return isinstance(place[-1], str)
    value = value_at(document, place)
    return what == "wrong type" or (isinstance(value, float | int) and not isinstance(value, bool))


def value_at(document, place):
    """Return the value at a place of a document."""
    for key in place:
        document = document[key]
    return document


def check_refused(read_text, document, *, optional=(), loose=(), large=(), count=200):
    """Check that a reader takes a document, and refuses each damaged copy with the field's name.

    Keys in `optional` may be missing, tables in `loose` have keys of their own, and numbers in
    `large` have no upper end; if it is None, numbers need not have one.
    """
    read_text(json.dumps(document))
    tried = 0
    for what, place, changed in damaged(document, count):
        names = [key for key in place if isinstance(key, str)]
        inside_loose = len(names) > 1 and names[-2] in loose
        if what in {"missing", "unknown key"} and (inside_loose or place[-1] in optional):
            continue
        if what == "too large" and (large is None or names[-1] in large):
            continue
        tried += 1
        named = names[-2:] if inside_loose else names[-1:]
        try:
            read_text(json.dumps(changed))
        except gc.InputError as error:
            said = str(error)
        else:
            raise AssertionError((what, place, "was read"))
        assert any(name in said for name in named), (what, place, said)
    assert tried


def optional_keys(kind):
    """Return the keys that files need not have, of a class of records and of those inside it."""
    found = set()
    for each in entries(kind):
        found |= {each.key} if each.default is not MISSING else set()
        for inner in _records_in(each.kind):
            found |= optional_keys(inner)
    return found


def _records_in(kind):
    if isinstance(kind, type) and is_dataclass(kind):
        return [kind]
    return [inner for part in get_args(kind) for inner in _records_in(part)]
