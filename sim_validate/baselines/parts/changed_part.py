"""Carries grasps over to their part as it is now, if its mesh file has changed since planning.

What is then tested is the part on the disk, not the one that the file of grasps remembers. Grasps
keep their ids, so that each is compared with its own entry of the baseline. Whoever wants every
change to be refused says so.
"""

from dataclasses import dataclass, field, replace
from pathlib import Path

from grasp_core.errors import InputError
from grasp_core.objects.polyhedron import UNITS_M, Polyhedron
from grasp_core.records.grasps_json import RECORDED, SavedGrasps
from grasp_core.transferring.changed_part import (
    fitting_lengths,
    fitting_unit,
    load_changed_part,
)
from grasp_core.transferring.like_faces import check_planar, likeness
from grasp_core.transferring.transfer import Transfer, transfer
from sim_validate.baselines.parts.if_changed import CARRY, FAIL, IfChanged
from sim_validate.baselines.parts.moves import Moves, moves_since_baseline, moves_since_planning
from sim_validate.baselines.parts.recorded_part import RecordedPart, RecordedShape, recorded_part
from sim_validate.baselines.parts.source_file import Source, fitting_exactly


class ChangedPartError(InputError):
    """Error for a mesh file that is refused because it has changed, is missing or is curved."""


@dataclass(frozen=True, slots=True, eq=False)
class Present:
    """The grasps of a file on their part as it is now."""

    saved: SavedGrasps
    """The grasps that can be tested: those of the file, or what became of them on the changed part,
    with their old ids."""
    source: Source = field(default_factory=Source)
    carried: Transfer | None = None
    """How they were carried over; None where the part is as it was."""
    unit: str = ""
    """Unit of length of the changed part's file; empty where the part is as it was."""
    asked: IfChanged = CARRY
    """What to do if the part has changed."""
    recorded_unit: str | None = None
    """Unit of the mesh file when the baseline was written; None if that is not known."""
    since: Moves | None = None
    """How faces moved since the baseline was written on a changed part; None where they are
    compared with those of the planned part."""

    @property
    def planned(self) -> Polyhedron:
        """Return the part that the grasps were planned on."""
        return self.saved.body if self.carried is None else self.carried.old

    @property
    def recorded(self) -> RecordedPart | None:
        """Return what a baseline must keep of the part; None where it is the planned one."""
        return None if self.carried is None else recorded_part(self.carried.old, self.carried.new)

    @property
    def gone(self) -> dict[str, str]:
        """Return why grasps of the file do not exist on the changed part, by id."""
        found = () if self.carried is None else self.carried.grasps
        return {each.old.id: each.reason for each in found if each.grasp is None}

    @property
    def change(self) -> str:
        """Say which faces moved and by how much; empty where the part is as it was."""
        if self.source.file is None or not (self.moves.faces or self.rescaled):
            return ""
        said = [self.rescaled, self.moves.in_words if self.moves.faces else "no face moved"]
        return f"{self.source.file} has changed{self.moves.since}: {'; '.join(filter(None, said))}"

    @property
    def rescaled(self) -> str:
        """Say that the mesh file is in another unit than the baseline's; empty if it is not."""
        unit = self.unit or self.source.unit
        if not (self.recorded_unit and unit) or self.asked.unit or unit == self.recorded_unit:
            return ""
        times = UNITS_M[self.recorded_unit] / UNITS_M[unit]
        return (
            f"its numbers are {times:.4g} times what they were, so it is taken to be in {unit} now "
            f"and no longer in {self.recorded_unit} (if it is not, say `unit`)"
        )

    @property
    def scale(self) -> float:
        """Return the factor on the coordinates of the mesh file, besides its unit."""
        return self.asked.scale or 1.0

    @property
    def file_lengths(self) -> tuple[str | None, float | None]:
        """Find the unit and the scale of a mesh file with planar faces, for a baseline.

        Without a file they are None, and so is a scale of 1. A file that fits in no unit was read
        with a scale that nobody says here: then it is taken to be in metres, times a scale.
        """
        file, scale = self.source.file, self.scale
        if file is None or self.saved.body.patches is not None:
            return None, None
        unit = self.unit or self.source.unit or fitting_exactly(file, self.planned, scale)
        if unit is None:
            unit, scale = fitting_lengths(file, self.planned, RECORDED)
        return unit, None if scale == 1.0 else scale

    @property
    def moves(self) -> Moves:
        """Return how faces moved, since the baseline where it tells, or else since planning."""
        if self.since is not None:
            return self.since
        return Moves() if self.carried is None else moves_since_planning(self.carried)

    @property
    def note(self) -> str:
        """Say what readers must know about the mesh that is tested; empty if nothing."""
        if not self.change:
            return self.source.note
        return (
            self.change
            if self.carried is None
            else f"{self.change}; its grasps were carried over to it"
        )

    @property
    def mesh(self) -> Source:
        """Return the mesh file, with what readers must know about it."""
        return replace(self.source, note=self.note)

    def id_on_part(self, name: str) -> str | None:
        """Return the id that a grasp of the file has on the changed part; None if it is gone."""
        found = () if self.carried is None else self.carried.grasps
        return next((each.grasp.id for each in found if each.old.id == name and each.grasp), None)

    def planned_faces(self, name: str) -> tuple[int, ...]:
        """Return the faces of the planned part that a grasp of the file touches."""
        grasps = self.saved.grasps if self.carried is None else [e.old for e in self.carried.grasps]
        return next((grasp.faces for grasp in grasps if grasp.id == name), ())

    def first(self, limit: int | None) -> "Present":
        """Return only the first grasps of the file, up to a limit."""
        if self.carried is None:
            return replace(self, saved=replace(self.saved, grasps=self.saved.grasps[:limit]))
        kept = self.carried.grasps[:limit]
        return self._with(replace(self.carried, grasps=kept))

    def only(self, name: str) -> "Present":
        """Return only the grasp with an id; none if the file has no such grasp."""
        if self.carried is None:
            one = tuple(grasp for grasp in self.saved.grasps if grasp.id == name)
            return replace(self, saved=replace(self.saved, grasps=one))
        kept = tuple(each for each in self.carried.grasps if each.old.id == name)
        return self._with(replace(self.carried, grasps=kept))

    def _with(self, carried: Transfer) -> "Present":
        return replace(self, saved=_tested(self.saved, carried), carried=carried)

    def against(self, before: RecordedShape) -> "Present":
        """Measure how faces moved from where they were when a baseline was written.

        If the baseline does not hold the part, it was written on the planned one.
        """
        planned, part, now = self.planned, before.part, self.saved.body
        found = replace(self, recorded_unit=before.unit)
        if part is None or part.planned_sha256 != planned.content_sha256:
            return found
        if now.content_sha256 == before.content_sha256:
            return replace(found, since=Moves())
        if self.source.file is None or self.asked.refuse:
            return found
        rule = likeness(planned, self.asked.distance_m, self.asked.angle_deg)
        then = part.body(planned.name, before.content_sha256)
        return replace(found, since=moves_since_baseline(then, planned, now, rule))


def present(saved: SavedGrasps, path: Path, source: Source, asked: IfChanged = CARRY) -> Present:
    """Carry grasps over to their part as it is now; they stay as they are if it has not changed."""
    if source.note and asked.missing == FAIL:
        raise ChangedPartError(
            f"{path}: the mesh file that its grasps were planned from, {saved.body.name!r} with "
            f'some ending, is missing, and `missing = "{FAIL}"` refuses to test the mesh that '
            f"{path.name} holds; put the file back, or say with `object` where it is"
        )
    if not source.changed or source.file is None:
        return Present(saved, source, asked=asked)
    if asked.refuse:
        raise ChangedPartError(
            f"{source.file}: this is not the mesh that {path} was planned on, and `refuse = true` "
            "makes the grasps of a changed part not comparable. Plan on the part again (graspproof "
            f"plan {source.file} --out ...) and bless (pytest --grasp-bless), or put the former "
            "file back; if this is another object's file, name the right one with `object`"
        )
    unit, carried = _carried(saved, path, source.file, asked)
    return Present(_tested(saved, carried), source, carried, unit, asked)


def _carried(saved: SavedGrasps, path: Path, file: Path, asked: IfChanged) -> tuple[str, Transfer]:
    """Read the changed part, in the unit that is returned, and carry the grasps over to it."""
    try:
        check_planar(saved.body, "the old part")
        scale = asked.scale or 1.0
        unit = asked.unit or fitting_unit(file, saved.body, RECORDED, scale=scale)
        new = load_changed_part(file, saved.body, unit, RECORDED, scale=scale)
        return unit, transfer(
            saved.body, new, saved.grasps, saved.friction, distance=asked.distance_m,
            angle_deg=asked.angle_deg, finger=saved.finger,
        )  # fmt: skip
    except InputError as error:
        said = str(error).removeprefix(f"{file}: ")
        raise ChangedPartError(
            f"{file}: this is not the mesh that {path} was planned on, and its grasps cannot be "
            f"carried over: {said}"
        ) from error


def _tested(saved: SavedGrasps, carried: Transfer) -> SavedGrasps:
    """Return the carried grasps with their old ids."""
    grasps = tuple(
        replace(each.grasp, id=each.old.id) for each in carried.grasps if each.grasp is not None
    )
    return replace(saved, body=carried.new, grasps=grasps)


def testable(now: Present, limit: int | None) -> SavedGrasps:
    """Return the grasps that a new baseline is about."""
    first = now.first(limit)
    if first.gone and not first.saved.grasps:
        name, why = next(iter(first.gone.items()))
        raise ChangedPartError(
            f"{now.change}; none of its {len(first.gone)} grasps exists on it, so there is nothing "
            f"to record ({name}: {why}); plan on it again"
        )
    return first.saved
