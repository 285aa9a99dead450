"""Reads the poses that `graspproof reach` found: the reached ones of a `reaches.json`.

The root of a built-in hand is that of its file in DexGraspBench. A hand from a file has its palm
somewhere in the world of that file, which `reaches.json` does not say, so its poses are refused.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from grasp_core.errors import InputError
from grasp_core.files.json_text import check_schema
from grasp_core.files.records import from_record
from grasp_core.names import HANDS
from sim_validate.hands.dexgraspbench import hand_file
from sim_validate.hands.reaches import Reaches
from sim_validate.judge.formats.fields import Source, entry
from sim_validate.judge.records import GraspRecord, HandRecord, Posture


def read(found: Any, source: Source) -> Iterator[GraspRecord]:
    """Read the poses of a checked file; their ids are the file and the id of the grasp."""
    entry(found, "reaches")
    check_schema(found, Reaches.SCHEMA)
    file = from_record(Reaches, {key: found[key] for key in found if key != "schema"})
    if file.hand.name not in HANDS:
        raise InputError(
            f"the hand {file.hand.name} is from a file, in which these poses of its palm cannot be "
            "placed; write poses of its root as a table"
        )
    palm = np.linalg.inv(hand_file(file.hand).root)
    names = tuple(joint.name for joint in file.hand.joints)
    for each in file.reaches:
        root, joints, opened = each.reach.palm_pose, each.reach.joints, each.reach.pregrasp
        if root is not None and joints is not None:
            root = root @ palm
            yield HandRecord(
                f"{source.name}#{each.id}", file.object.name, 1.0, names, Posture(root, joints),
                None if opened is None else Posture(root, opened), None, np.eye(3),
            )  # fmt: skip
