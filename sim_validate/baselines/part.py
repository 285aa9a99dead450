"""Carries grasps over to their part as it is now, if its mesh file has changed since planning.

A mesh file counts as unchanged if its bytes are those that were planned from, or if it gives the
same solid in some unit. Grasps keep their ids, so that each is compared with its own entry of the
baseline; faces are called by their numbers on the planned part, of which ids are made.
"""

import hashlib
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

from grasp_core.errors import InputError, MeshError
from grasp_core.files.text_files import read_bytes
from grasp_core.mesh_files.limits import MESH_FORMATS
from grasp_core.objects.on_faces import check_planar
from grasp_core.objects.polyhedron import UNITS_M, Polyhedron, load_polyhedron
from grasp_core.planning.grasps_json import RECORDED
from grasp_core.planning.result import Plan
from grasp_core.transferring.part_comparison import (
    added_faces,
    changes_in_words,
    face_changes,
    likeness,
)
from grasp_core.transferring.settings import IfChanged
from grasp_core.transferring.transfer import (
    CarriedGrasp,
    Transfer,
    as_read,
    fitting_lengths,
    fitting_unit,
    transfer,
)
from sim_validate.baselines.baseline import Baseline, RecordedPart

CHANGED_PART = "changed_part"
CARRY = IfChanged()
NONE_MOVED = "no face moved"


@dataclass(frozen=True, slots=True)
class SourceMesh:
    """The mesh file that grasps were planned from, if it was found."""

    file: Path | None = None
    """Path of the mesh file; None if it was not found, or the grasps come from no file."""
    note: str = ""
    changed: bool = False
    """Whether the file holds another solid than the one that was planned on."""
    unit: str = ""
    """Unit in which a file of other bytes holds the same solid; empty where that does not matter.
    """


def source_of(
    saved: Plan,
    grasps: Path,
    folders: Iterable[Path],
    named: Path | None = None,
    scale: float | None = None,
) -> SourceMesh:
    """Find the mesh file that grasps were planned from.

    Of several files with the object's name, an unchanged one is taken, or else the first.
    """
    body = saved.body
    if body.source_sha256 == body.content_sha256:
        if named is not None:
            raise InputError(
                f"{grasps}: these grasps were not planned from a mesh file, so not from {named}; "
                "leave `object` out, or plan from the file"
            )
        return SourceMesh()
    found = [named] if named is not None else _beside(body.name, [grasps.parent, *folders])
    for path in found:
        if hashlib.sha256(read_bytes(path)).hexdigest() == body.source_sha256:
            return SourceMesh(
                file=path
            )  # the body was read from these very bytes, whatever their unit
        if (unit := fitting_exactly(path, body, scale)) is not None:
            return SourceMesh(file=path, unit=unit)
    if found:
        return SourceMesh(file=found[0], changed=True)
    return SourceMesh(
        note=f"{grasps}: the mesh that it holds was tested; the file it was planned from, "
        f"{body.name!r} with some ending, is not beside it (`object` in a *.grasps.toml says where)"
    )


def _beside(name: str, folders: Iterable[Path]) -> list[Path]:
    found = list[Path]()
    for folder in {folder.resolve(): folder for folder in folders}.values():
        with suppress(OSError):
            found += (path for path in sorted(folder.iterdir()) if path.stem == name)
    return [
        path for path in found if path.suffix.lower().lstrip(".") in MESH_FORMATS and path.is_file()
    ]


def fitting_exactly(path: Path, body: Polyhedron, scale: float | None) -> str | None:
    """Return the unit in which a file holds the very solid of a body; None if it does in none."""
    faces = "planar" if body.patches is None else "patches"
    for unit in UNITS_M:
        with suppress(MeshError):  # in another unit it may be too large for a solid
            read = load_polyhedron(
                path, unit=unit, scale=scale or 1.0, faces=faces, patches=body.patches,
                limits=RECORDED,
            )  # fmt: skip
            if read.content_sha256 == body.content_sha256:
                return unit
    return None


class ChangedPartError(InputError):
    """Error for a mesh file that is refused because it has changed, is missing or is curved."""


@dataclass(frozen=True, slots=True, eq=False)
class Present:
    """The grasps of a file on their part as it is now."""

    saved: Plan
    """The grasps that can be tested: those of the file, or what became of them on the changed part,
    with their old ids."""
    source: SourceMesh = field(default_factory=SourceMesh)
    carried: Transfer | None = None
    """How they were carried over; None where the part is as it was."""
    unit: str = ""
    """Unit of length of the changed part's file; empty where the part is as it was."""
    asked: IfChanged = CARRY
    recorded_unit: str | None = None
    """Unit of the mesh file when the baseline was written; None if that is not known."""
    since: str | None = None
    """How faces moved since the baseline was written on a changed part, empty if they did not; None
    where they are compared with those of the planned part."""

    @property
    def planned(self) -> Polyhedron:
        """Return the part that the grasps were planned on."""
        return self.saved.body if self.carried is None else self.carried.old

    @property
    def recorded(self) -> RecordedPart | None:
        """Return what a baseline must keep of the part; None where it is the planned one."""
        planned, tested = self.planned, self.saved.body
        if planned.content_sha256 == tested.content_sha256:
            return None
        solid = (tested.vertices, tested.triangles, tested.surface)
        return RecordedPart(planned.content_sha256, *solid)

    @property
    def gone(self) -> dict[str, str]:
        """Return why grasps of the file do not exist on the changed part, by id."""
        return {each.old.id: each.reason for each in self._moved if each.grasp is None}

    @property
    def _moved(self) -> tuple[CarriedGrasp, ...]:
        return () if self.carried is None else self.carried.grasps

    @property
    def change(self) -> str:
        """Say which faces moved and by how much; empty where the part is as it was."""
        if self.source.file is None or not (self.faces_moved or self.rescaled):
            return ""
        said = "; ".join(filter(None, [self.rescaled, self.faces_moved or NONE_MOVED]))
        when = " since its baseline was written" if self.since else ""
        return f"{self.source.file} has changed{when}: {said}"

    @property
    def faces_moved(self) -> str:
        """Say which faces moved, since the baseline where it tells, or else since planning."""
        if self.since is not None or self.carried is None:
            return self.since or ""
        return changes_in_words(self.carried.faces, self.carried.added) or NONE_MOVED

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
    def note(self) -> str:
        """Say what readers must know about the mesh that is tested; empty if nothing."""
        if not self.change:
            return self.source.note
        carried = "" if self.carried is None else "; its grasps were carried over to it"
        return self.change + carried

    @property
    def mesh(self) -> SourceMesh:
        """Return the mesh file, with what readers must know about it."""
        return replace(self.source, note=self.note)

    def id_on_part(self, name: str) -> str | None:
        """Return the id that a grasp of the file has on the changed part; None if it is gone."""
        named = (each.grasp for each in self._moved if each.old.id == name)
        return next((grasp.id for grasp in named if grasp), None)

    def first(self, limit: int | None) -> "Present":
        """Return only the first grasps of the file, up to a limit."""
        moved = [each.old for each in self._moved]
        grasps = self.saved.grasps if self.carried is None else moved
        return self.only(*(grasp.id for grasp in grasps[:limit]))

    def testable(self, limit: int | None) -> "Present":
        """Return the first grasps, some of which must exist on the part."""
        first = self.first(limit)
        if first.gone and not first.saved.grasps:
            name, why = next(iter(first.gone.items()))
            raise ChangedPartError(
                f"{self.change}; none of its {len(first.gone)} grasps exists on it, so there is "
                f"nothing to record ({name}: {why}); plan on it again"
            )
        return first

    def only(self, *names: str) -> "Present":
        """Return only the grasps with these ids, of those that the file has."""
        chosen = tuple(grasp for grasp in self.saved.grasps if grasp.id in names)
        kept = tuple(each for each in self._moved if each.old.id in names)
        carried = self.carried and replace(self.carried, grasps=kept)
        return replace(self, saved=replace(self.saved, grasps=chosen), carried=carried)

    def against(self, before: Baseline) -> "Present":
        """Measure how faces moved from where they were when a baseline was written.

        If the baseline does not hold the part, it was written on the planned one.
        """
        planned, part, now = self.planned, before.part, self.saved.body
        found = replace(self, recorded_unit=before.unit)
        if part is None or part.planned_sha256 != planned.content_sha256:
            return found
        if now.content_sha256 == before.object.content_sha256:
            return replace(found, since="")
        if self.source.file is None or self.asked.refuse:
            return found
        rule = likeness(planned, self.asked.distance_m, self.asked.angle_deg)
        then = part.body(planned.name, before.object.content_sha256)
        numbers = {
            change.new: change.old
            for change in face_changes(planned, then, rule)
            if change.new is not None
        }
        faces = face_changes(then, now, rule)
        words = changes_in_words(faces, added_faces(faces, now), numbers)
        return replace(found, since=words or NONE_MOVED)


def present(
    saved: Plan, path: Path, folders: Iterable[Path], asked: IfChanged = CARRY,
    named: Path | None = None,
) -> Present:  # fmt: skip
    """Carry the grasps of a file over to their part as it is now, if its mesh file has changed.

    Folders, or the name of the mesh file, are as `source_of` takes them.
    """
    source = source_of(saved, path, folders, named, asked.scale)
    if source.note and asked.missing == "fail":
        raise ChangedPartError(
            f"{path}: the mesh file that its grasps were planned from, {saved.body.name!r} with "
            f'some ending, is missing, and `missing = "fail"` refuses to test the mesh that '
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
    grasps = tuple(
        replace(each.grasp, id=each.old.id) for each in carried.grasps if each.grasp is not None
    )
    return Present(replace(saved, body=carried.new, grasps=grasps), source, carried, unit, asked)


def _carried(saved: Plan, path: Path, file: Path, asked: IfChanged) -> tuple[str, Transfer]:
    try:
        check_planar(saved.body, "the old part")
        scale = asked.scale or 1.0
        unit = asked.unit or fitting_unit(file, saved.body, RECORDED, scale=scale)
        same = as_read(saved.body)
        new = load_polyhedron(file, unit=unit, scale=scale, limits=RECORDED, **same)
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
