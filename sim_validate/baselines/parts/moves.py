"""Says how the faces of a part moved since its grasps were planned, or since its baseline.

Faces are called by their numbers on the planned part, because ids of grasps are made of these.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.transferring.face_changes import (
    FaceChange,
    added_faces,
    changes_in_words,
    face_changes,
)
from grasp_core.transferring.like_faces import Likeness
from grasp_core.transferring.transfer import Transfer


@dataclass(frozen=True, slots=True)
class Moves:
    """How the faces of a part moved between two of its shapes."""

    faces: tuple[FaceChange, ...] = ()
    """What became of each face of the earlier shape; none if both shapes are the same."""
    added: tuple[int, ...] = ()
    """Faces of the later shape that succeed no earlier one."""
    numbers: Mapping[int, int] | None = None
    """Numbers on the planned part of the earlier shape's faces; None if that is the planned part.
    """
    since: str = ""
    """Since when, such as ` since its baseline was written`; empty for planning."""

    @property
    def in_words(self) -> str:
        """Say in one line which faces moved and by how much."""
        return changes_in_words(self.faces, self.added, self.numbers)

    def touched(self, faces: Iterable[int]) -> str:
        """Say which of some faces moved, such as `face 3, which moved`; empty if none did."""
        wanted = {*faces}
        names = (
            change.old if self.numbers is None else self.numbers.get(change.old)
            for change in self.faces
            if change.moved
        )
        moved = sorted(name for name in names if name in wanted)
        many = "face" if len(moved) == 1 else "faces"
        return f"{many} {', '.join(map(str, moved))}, which moved" if moved else ""


def moves_since_planning(carried: Transfer) -> Moves:
    """Return how faces moved since grasps that were carried over were planned."""
    return Moves(carried.faces, carried.added)


def moves_since_baseline(
    then: Polyhedron, planned: Polyhedron, now: Polyhedron, rule: Likeness
) -> Moves:
    """Compare a part with what it was when its baseline was written."""
    numbers = {
        change.new: change.old
        for change in face_changes(planned, then, rule)
        if change.new is not None
    }
    found = face_changes(then, now, rule)
    return Moves(found, added_faces(found, now), numbers, " since its baseline was written")
