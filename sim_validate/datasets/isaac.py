"""Exports the poses of a hand in the grasps of a dataset, as an Isaac grasp file for each object.

A grasp is named as its row, by object, friction and faces. Grasps that the hand does not reach, or
in which it cannot open its fingers, are left out, and so are varied grasps and negative controls.
"""

import re
from collections import Counter
from collections.abc import Callable
from itertools import groupby
from pathlib import Path

from grasp_core.errors import InputError
from grasp_core.files.text_files import write_text
from sim_validate.datasets.columns import GraspRow, ObjectRow
from sim_validate.datasets.config import ID_DIGITS, SplitName
from sim_validate.datasets.open_dataset import select
from sim_validate.files.output_folders import whole_folder
from sim_validate.hands.isaac import BY_THE_HAND, UNTRIED, IsaacGrasp, isaac_text

UNSAFE = re.compile(r"[^A-Za-z0-9._-]")
LONGEST_NAME = 150
"""Largest number of characters in a file's name without its ending; every file system allows more.
"""


def export(
    folder: Path, out: Path, split: SplitName | None, report: Callable[[int, int], None]
) -> Counter[str]:
    """Write the poses of a dataset's hand, or of one split; equal datasets give equal bytes.

    Takes `report` (objects written, all objects). Returns the numbers of objects with a file
    (`objects`), of grasps in the files (`grasps`), and of grasps that are left out because the hand
    cannot open its fingers there (`never_opens`).
    """
    chosen = select(folder, split)
    hand = chosen.hand
    if hand is None:
        raise InputError(
            f"{folder}: Isaac grasp files are of hands, so the dataset must have poses of one, got "
            "none; build it with --hand"
        )
    if out.resolve().is_relative_to(folder.resolve()):
        raise InputError(
            f"{out}: --out must be outside of the dataset that is exported; give another folder"
        )
    names = {row.object_id: row.source_name for row in chosen.rows(ObjectRow)}
    rows = chosen.rows(GraspRow, hand_reached=True, label="grasp")
    done = Counter(objects=0, grasps=0, never_opens=0)
    with whole_folder(out) as place:
        for object_id, of_object in groupby(rows, key=lambda row: row.object_id):
            reached = list(of_object)
            found = [pose for row in reached if (pose := _pose(row)) is not None]
            done["never_opens"] += len(reached) - len(found)
            if not found:
                continue
            # the object's hash tells files apart, whatever of its name they can keep
            of = names.get(object_id, object_id)
            name = UNSAFE.sub("_", f"{object_id[:ID_DIGITS]}-{of}")[:LONGEST_NAME]
            write_text(place / f"{name}.yaml", isaac_text(hand, of, found, BY_THE_HAND))
            done.update(objects=1, grasps=len(found))
            report(done["objects"], len(names))
    return done


def _pose(row: GraspRow) -> IsaacGrasp | None:
    """Take the pose of the hand from a row; None where it has none with open fingers."""
    hand = row.hand
    if hand is None or hand.palm_pose is None or hand.joints is None or hand.open_joints is None:
        return None
    tried = [each for each in (hand.held, hand.survived) if each is not None]
    trusted = float(all(tried)) if tried else UNTRIED
    return IsaacGrasp(row.grasp_id, trusted, hand.palm_pose, hand.joints, hand.open_joints)
