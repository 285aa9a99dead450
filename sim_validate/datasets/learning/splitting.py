"""Divides objects among splits that are never empty: object by object, or by class of shape.

The usual split by hash moves no object when others are added, but small datasets may have empty
splits. Here the places are counted, so that every split has an object wherever there are three.
"""

import hashlib
from collections.abc import Mapping, Sequence

from sim_validate.datasets.columns import SplitName

SHARE = 0.1
"""Share of the objects that are for testing, and of those for validation."""
SPLIT_COUNT = 3


def assigned(classes: Mapping[str, str], by: str, seed: int) -> dict[str, SplitName]:
    """Return the split of each object.

    Classes are whole in one split. Two classes leave none for validation, which then takes objects
    of the larger one; objects of a single class are divided one by one.
    """
    kinds = sorted(set(classes.values()))
    if by == "object" or len(kinds) < SPLIT_COUNT - 1:
        return _one_by_one(sorted(classes), seed)
    members = {kind: sorted(each for each in classes if classes[each] == kind) for kind in kinds}
    largest = max(kinds, key=lambda kind: (len(members[kind]), kind))
    order = [kind for kind in _shuffled(kinds, seed) if kind != largest]
    if not order[1:]:
        rest = _one_by_one(members[largest], seed, ("validation",))
        return {**rest, **dict.fromkeys(members[order[0]], "test")}
    found: dict[str, SplitName] = dict.fromkeys(classes, "train")
    wanted = SHARE * len(classes)
    places: list[SplitName] = ["test", "validation"]
    for place, split in enumerate(places):
        left = len(places) - place - 1
        count = 0
        while count == 0 or (count < wanted and len(order) > left):
            kind = order.pop(0)
            found |= dict.fromkeys(members[kind], split)
            count += len(members[kind])
    return found


def _one_by_one(
    names: Sequence[str], seed: int, held_out: tuple[SplitName, ...] = ("test", "validation")
) -> dict[str, SplitName]:
    """Hold out a share of the objects for each of some splits, at least one, and train on one."""
    order = _shuffled(names, seed)
    found: dict[str, SplitName] = dict.fromkeys(names, "train")
    count = max(1, round(SHARE * len(names)))
    for split in held_out:
        for _ in range(min(count, len(order) - 1)):
            found[order.pop(0)] = split
    return found


def _shuffled(names: Sequence[str], seed: int) -> list[str]:
    return sorted(names, key=lambda name: hashlib.sha256(f"{seed} {name}".encode()).digest())
