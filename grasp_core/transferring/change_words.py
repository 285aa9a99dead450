"""Says in one line how the faces of a part have changed.

If one shift explains all moves, it is said first. With outward normals o and moves h along them, as
in `face_changes`, a shift t moves each face by

    o.t = h.                                                                            (1)

The faces of a solid face all ways, so at most one t solves (1).
"""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from grasp_core.arrays import Array
from grasp_core.by_value import counted
from grasp_core.transferring.face_changes import TURNED, FaceChange
from grasp_core.transferring.face_places import in_mm

MOST_NAMED = 12
"""Largest number of faces that one line names."""
FITS = 1e-3
"""Largest distance from (1) that a shift explains, relative to the shift."""
ALL_WAYS = 3
"""Number of independent directions that the faces of a solid face."""


def in_words(
    changes: Iterable[FaceChange],
    added: Sequence[int] = (),
    numbers: Mapping[int, int] | None = None,
) -> str:
    """Say in one line which faces moved, the farthest first, and which have another outline."""
    listed = list(changes)
    names = {each.old: each.old for each in listed} if numbers is None else numbers
    moved = sorted(
        (change for change in listed if change.moved),
        key=lambda change: (change.new is not None, -abs(change.distance), change.old),
    )
    said = [_named(change, names) for change in moved[:MOST_NAMED]]
    if len(moved) > MOST_NAMED:
        said.append(f"{len(moved) - MOST_NAMED} more faces moved")
    if (shift := common_shift(listed, added)) is not None:
        way = ", ".join(map(in_mm, shift.tolist()))
        said.insert(0, f"it is as if the whole part were shifted by ({way}) mm")
    kept = [change for change in listed if change.reshaped and not change.moved]
    smaller = [change for change in kept if change.new_area < change.old_area]
    larger = [change for change in kept if change.new_area > change.old_area]
    said += [f"{_together(group, names)} became {word}"
             for group, word in ((smaller, "smaller"), (larger, "larger")) if group]  # fmt: skip
    likely = {change.likely for change in listed}
    if new := sum(index not in likely for index in added):
        said.append(counted(new, "new face"))
    return "; ".join(said) or "no face moved"


def common_shift(changes: Sequence[FaceChange], added: Sequence[int] = ()) -> Array | None:
    """Find the shift that explains all moves of faces, (3,) [m]; None if no shift does."""
    if added or any(each.new is None or each.turn > TURNED or each.reshaped for each in changes):
        return None
    if sum(each.moved for each in changes) <= 1:
        return None  # nothing moved, or one face alone, which is no shift of the part
    normals = [each.normal for each in changes if each.normal is not None]
    if len(normals) < len(changes):
        return None
    outward = -np.array(normals)
    moves = np.array([each.distance for each in changes])
    shift, _, rank, _ = np.linalg.lstsq(outward, moves)
    if rank < ALL_WAYS:
        return None
    off = float(np.abs(outward @ shift - moves).max())
    return shift if off <= FITS * float(np.linalg.norm(shift)) else None


def _named(change: FaceChange, names: Mapping[int, int]) -> str:
    return change.in_words(_name(change, names), names.get(change.old))


def _name(change: FaceChange, names: Mapping[int, int]) -> str:
    return f"face {names[change.old]}" if change.old in names else "a newer face"


def _together(faces: Sequence[FaceChange], names: Mapping[int, int]) -> str:
    """Name some faces, such as `faces 1, 2`; one alone with its place."""
    if len(faces) == 1:
        return faces[0].called(_name(faces[0], names))
    known = sorted(names[face.old] for face in faces if face.old in names)
    if not known:
        return counted(len(faces), "newer face")
    listed = ", ".join(map(str, known[:MOST_NAMED]))
    more = len(faces) - min(len(known), MOST_NAMED)
    return f"faces {listed}{f' and {more} more' if more else ''}"
