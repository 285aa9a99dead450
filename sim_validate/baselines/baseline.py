"""Keeps what a baseline says: a header, the part, and the figures of the verdict on each grasp.

A baseline is JSON that people can review: a header, then one line per grasp. The figures are those
that the classes of verdicts and executions declare as compared. Once it is written on a changed
part, it holds that shape, so that moves of faces are measured from what was accepted.
"""

from collections.abc import Iterator, Mapping
from dataclasses import field
from pathlib import Path, PurePath
from typing import Annotated, Any, Self, get_args, get_origin

from pydantic import Field

from grasp_core.allowed_values import FLAT, Count, FrictionOrZero, NotNegative, Number
from grasp_core.arrays import Array, Indices, Shape
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError, about
from grasp_core.figures import Figure, compared
from grasp_core.files.file_kinds import BASELINE
from grasp_core.files.json_text import shown
from grasp_core.files.records import RecordFile, record_of
from grasp_core.files.text_files import read_text, write_text
from grasp_core.objects.build import MeshChoices
from grasp_core.objects.polyhedron import Polyhedron, polyhedron_from_mesh
from grasp_core.objects.surface import Surface
from grasp_core.planning.grasps_json import RECORDED
from grasp_core.settings import Settings, extended
from sim_validate.closure.verdict import Verdict
from sim_validate.engine.held_or_let_go import Outcome
from sim_validate.engine.setup import Agenda, Setup
from sim_validate.execution.verdict import ExecutedGrasp, Execution
from sim_validate.files.kept_figures import Kept, keeps
from sim_validate.files.result_files import AboutObject
from sim_validate.settings import ExecutionSettings

BASELINE_DIGITS = 12
BASELINE_MARK = '"grasps_file"'


def in_baselines(kind: type) -> Iterator[Figure]:
    """Yield the compared figures of a class: of a list without names, the number of items.

    Parts of records that are flat, classes of kept figures name themselves.
    """
    for each in (each for each in compared(kind) if each.path == (each.name,)):
        whole, how = get_args(each.kind)[0], each.compared
        counted = get_origin(whole) is tuple and how is not None and how.items is None
        numbered = counted and float not in get_args(whole)
        yield each._replace(kind=Annotated[Number, how]) if numbered else each


@keeps(in_baselines(Verdict), BASELINE_DIGITS)
class VerdictFigures(Kept):
    """The figures of a verdict."""


@keeps(in_baselines(Execution), BASELINE_DIGITS)
class ExecutionFigures(Kept):
    """The figures of an execution."""


@keeps(in_baselines(ExecutedGrasp), BASELINE_DIGITS)
class ExecutedFigures(Kept):
    """The figures of a grasp that was to be executed."""

    execution: Annotated[ExecutionFigures | None, FLAT]

    @property
    def ran(self) -> bool:
        """Whether trials were run, which a squeeze and a possible trial are needed for."""
        return self.execution is not None and self.execution.trials > 0


@declared
class KeptGrasp(Declared):
    """What a baseline keeps of one grasp."""

    id: str
    contacts_sha256: str
    verdict: Annotated[VerdictFigures, FLAT]
    execution: ExecutedFigures | None = None
    """How the grasp was executed; None if that is not asked for."""

    def _check_together(self) -> None:
        if self.held == bool(self.verdict.not_held):
            raise InputError(
                f"`outcome` {self.verdict.outcome.value} contradicts `not_held`, which is "
                f"{list(self.verdict.not_held)}; write the file again"
            )

    @property
    def held(self) -> bool:
        """Whether the grasp held every wrench."""
        return self.verdict.outcome is Outcome.HELD

    @classmethod
    def of(cls, verdict: Verdict, executed: ExecutedGrasp | None = None) -> Self:
        """Keep the figures of a verdict, and of an execution if there is one."""
        execution = None if executed is None else ExecutedFigures.of(executed)
        return cls(verdict.id, verdict.contacts_sha256, VerdictFigures.of(verdict), execution)

    def properties(self) -> Mapping[str, Any]:
        """Return every figure by name, plain, those of the execution beside the others."""
        found = record_of(self)
        executed: Mapping[str, Any] = found.pop("execution") or {}
        return found | {f"execution.{name}": value for name, value in executed.items()}


@declared
class RecordedPart(Declared):
    """The changed part that a baseline was written on."""

    planned_sha256: str
    vertices_m: Annotated[Array, Shape("n", 3)]
    triangles: Annotated[Indices, Shape("t", 3, whole=True)]
    surface: Surface

    def body(self, name: str, content_sha256: str) -> Polyhedron:
        """Build the part, with planar faces."""
        try:
            found = polyhedron_from_mesh(
                self.vertices_m,
                self.triangles,
                extended(MeshChoices, RECORDED, faces="planar"),
                name=name,
                known=self.surface,
            )
        except (ValueError, InputError) as error:
            raise InputError(f"part: expected the mesh of a solid: {error}") from error
        if found.content_sha256 != content_sha256:
            raise InputError(
                "part: the mesh in the baseline is not the one that its content_sha256 says; write "
                "the baseline again with --grasp-bless"
            )
        return found


@declared
class How(Settings):
    """How the grasps of a baseline are simulated."""

    setup: Setup = field(default_factory=Setup)
    agenda: Annotated[Agenda, FLAT] = field(default_factory=Agenda)
    execution: ExecutionSettings | None = None
    """How grasps are executed besides; None if they are not."""


@declared
class Baseline(RecordFile):
    """Verdicts on the grasps of one object, and all settings and versions that they depend on."""

    FILE = BASELINE
    SCHEMA = 2

    grasps_file: str
    """Path of the grasps, relative to the baseline's folder."""
    limit: Count | None
    """Number of grasps that are kept, the first ones of the file; None for all."""
    object: AboutObject
    friction: FrictionOrZero
    planned_radius_m: NotNegative | None
    settings: How
    versions: Mapping[str, str]
    arithmetic: str
    unit: str | None = None
    """Unit of length of the mesh file; None where there is none, or it was not known."""
    scale: NotNegative | None = None
    """Factor on the coordinates of the mesh file, besides its unit; None where there is none."""
    part: RecordedPart | None = None
    """The part that it was written on; None where that is the one that the grasps were planned on.
    """
    entries: Annotated[tuple[KeptGrasp, ...], Field(alias="grasps")] = ()

    def _check_together(self) -> None:
        if len({entry.id for entry in self.entries}) < len(self.entries):
            raise InputError("grasps: two grasps of the baseline have the same id; remove one")
        if PurePath(self.grasps_file).is_absolute() or not self.grasps_file.isprintable():
            raise InputError(
                "grasps_file: expected a path relative to this baseline's folder, got "
                f"{shown(self.grasps_file)}; name the file with --grasps"
            )


def read_baseline(path: Path) -> Baseline:
    """Read the baseline in a file; one without a grasp is refused, because it checks nothing."""
    found = Baseline.read(path)
    if not found.entries:
        with about(path):
            raise InputError("grasps: expected at least one grasp, got none")
    return found


def write_baseline(path: Path, baseline: Baseline) -> None:
    """Write a baseline to a new file, or over another baseline."""
    check_writable(path)
    write_text(path, baseline.text())


def check_writable(path: Path) -> None:
    """Refuse a path where a file stands that is not a baseline of any version."""
    if path.exists() and BASELINE_MARK not in read_text(path):
        raise InputError(
            f"{path}: this file is not a baseline and will not be overwritten; choose another path"
        )
