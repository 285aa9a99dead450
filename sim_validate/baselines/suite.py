"""Reads what tests ask for: grasps that must stay as stable as their baseline says, or must be.

A `*.grasps.toml` file names grasps, their baseline and settings. A test in code reads or plans its
own grasps, and says what it demands of them.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

from annotated_types import Interval

from grasp_core.allowed_values import (
    LARGEST_FRICTION,
    RandomWrenches,
    Repeats,
    Seed,
    Share,
    value_of,
)
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError, about
from grasp_core.objects.polyhedron import Polyhedron, load_polyhedron
from grasp_core.planning.grasps_json import load_grasps
from grasp_core.planning.planner import plan
from grasp_core.planning.result import Plan
from grasp_core.planning.settings import PlanSettings
from grasp_core.settings import CHOSEN, Settings, for_users, named
from grasp_core.values import Grasp
from scenes.example_objects import example_object
from sim_validate.baselines import check
from sim_validate.baselines.baseline import Baseline, How, check_writable, read_baseline
from sim_validate.baselines.part import CARRY, CHANGED_PART, IfChanged, Present, SourceMesh, present
from sim_validate.closure.validate import validate
from sim_validate.closure.verdict import Verdict
from sim_validate.engine.setup import Agenda, Setup, wrenches_from_file
from sim_validate.execution.execute import ExecutionJob, executed_grasp
from sim_validate.execution.verdict import ExecutedGrasp
from sim_validate.files.toml_files import read_tables
from sim_validate.settings import USUAL_FRICTION, ExecutionSettings, LimitSearch, Noise

SUITE_ENDING = ".grasps.toml"
AGENDA_SETTINGS = ("limits", "random_wrenches", "repeats", "noise", "seed")


@declared(slots=False)
class Suite(Settings):
    """Grasps that must stay as stable as they were; a setting of None is the baseline's."""

    grasps: Path
    """Path of a grasps.json; paths start at the folder of the file that names them."""
    baseline: Path = Path("NAME.baseline.json")
    """Path of the baseline; if not given, that with the name of the file."""
    object: Path | None = None
    """The mesh file that the grasps were planned from; None to search beside them for the object's
    name."""
    strict: bool = False
    """Whether an improvement fails the test, too."""
    setup: Path | None = None
    """Path of a TOML file of settings of the simulation."""
    wrenches: Path | None = None
    """Path of a wrench file."""
    limits: LimitSearch | None = None
    """How the largest multiple of each wrench is found in simulation."""
    random_wrenches: RandomWrenches | None = None
    """Number of random wrenches that each grasp must hold as well."""
    repeats: Repeats | None = None
    """Number of repeats with noise."""
    noise: Noise | None = None
    """Random errors of the repeats."""
    seed: Seed | None = None
    """Seed of random wrenches, noise and negative controls."""
    survives: bool = False
    """Whether each grasp must keep the object in every trial of its execution."""
    execution: ExecutionSettings | None = None
    """How grasps are executed."""
    changed_part: IfChanged = CARRY
    """What to do if the part has another shape than the grasps were planned for."""
    path: Annotated[Path, CHOSEN] = Path(SUITE_ENDING)
    """The file itself."""

    @cached_property
    def saved(self) -> Plan:
        """Read the grasps that the suite is about."""
        return load_grasps(self.grasps)

    @cached_property
    def asked(self) -> IfChanged:
        """Return what to do if the part has changed, with the scale of the baseline if it has one.

        A baseline that is refused is no reason to stop here, as it may be about to be replaced.
        """
        try:
            recorded = self.kept.scale
        except InputError:
            recorded = None
        return self.changed_part.with_scale(recorded)

    @cached_property
    def present(self) -> Present:
        """Carry the grasps over to their part as it is now."""
        return present(self.saved, self.grasps, [self.path.parent], self.asked, self.object)

    @cached_property
    def compared(self) -> Present:
        """Return the grasps on their part as it is now, compared with the part of the baseline."""
        return self.present.against(self.kept)

    @cached_property
    def kept(self) -> Baseline:
        """Read the baseline of the suite."""
        if not self.baseline.is_file():
            raise InputError(
                f"{self.baseline}: this baseline does not exist yet; write it with pytest "
                "--grasp-bless"
            )
        return read_baseline(self.baseline)

    @property
    def ids(self) -> list[str]:
        """List the ids of all grasps that are in the file or in the baseline."""
        kept = self.kept if self.baseline.is_file() else None
        ours = {grasp.id for grasp in self.saved.grasps[: kept and kept.limit]}
        return sorted(ours if kept is None else ours | {entry.id for entry in kept.entries})

    @property
    def files(self) -> tuple[Path, Path]:
        """The paths of the baseline and of the grasps."""
        return self.baseline, self.grasps

    def tested(self, name: str) -> check.CheckedBaseline:
        """Simulate one grasp again, and compare the result with the baseline."""
        now, before = self.compared, self.kept
        done = check.check(before, now, self.files, self._how(before), name=name)
        return check.demanded(done) if self.survives else done

    def bless(self) -> Baseline:
        """Simulate all grasps and write the results as the new baseline."""
        now = self.present
        check_writable(self.baseline)
        try:
            before = self.kept if self.baseline.is_file() else None
        except InputError as error:
            raise InputError(
                f"{error}; remove the file, then write a new baseline with pytest --grasp-bless"
            ) from error
        how = self._how(before)
        if before is not None:
            how = check.with_planned_fingers(how, before, now.saved)
        return check.measured(now, self.files, before and before.limit, how).bless()

    def _how(self, before: Baseline | None) -> How:
        if before is None:
            how = How(check.setup_for(self.saved, None), Agenda(seed=self.saved.seed))
        else:
            how = before.settings
        setup = how.setup if self.setup is None else check.setup_for(self.saved, self.setup)
        execution = how.execution if self.execution is None else self.execution
        if self.survives and execution is None:
            raise InputError(
                f"{self.path}: survives: expected a table [execution] too, which says how grasps "
                "are executed, but the file has none"
            )
        given: dict[str, Any] = {name: getattr(self, name) for name in AGENDA_SETTINGS}
        if self.wrenches is not None:
            given["wrenches"] = wrenches_from_file(self.wrenches)
        asked = {name: value for name, value in given.items() if value is not None}
        with about(self.path):
            return How(setup, replace(how.agenda, **asked), execution)


def suite_from_toml(path: Path) -> Suite:
    """Read a `*.grasps.toml` file; paths in it are relative to its folder."""
    return suite_from_tables(read_tables(path), path)


def suite_from_tables(given: Mapping[str, Any], path: Path) -> Suite:
    """Build a suite from the settings of a `*.grasps.toml` file."""
    usual = path.name.removesuffix(SUITE_ENDING) + ".baseline.json"
    with about(path):
        suite = Suite.of_table({"baseline": usual, **given})
    paths = {
        name: getattr(suite, name) for name in ("grasps", "object", "baseline", "setup", "wrenches")
    }
    found = {name: path.parent / value for name, value in paths.items() if value is not None}
    return replace(suite, path=path, **found)


TRIALS = ("wrenches", "repeats", "noise", "random_wrenches", "seed")
PLAN_SETTINGS = ("object", "friction", "limit", "families", "cones", "seed", "unit", "scale")


@declared
class GraspCase(Declared):
    """A grasp on its object, and the friction at which to test it."""

    body: Polyhedron
    grasp: Grasp
    friction: float
    source: SourceMesh = field(default_factory=SourceMesh)
    """The mesh file that the grasp was planned from, if it comes from a file of grasps."""
    gone: str = ""
    """Why the grasp does not exist on its changed part; empty if it does. Object and grasp are then
    those that the file holds."""


def case_of(
    given: Sequence[Any], friction: float | None, asking: str = "assert_stable"
) -> GraspCase:
    """Build a case from a test's arguments: a case, or object, grasp and perhaps friction."""
    kinds: list[type[Any]] = [type(each) for each in given]
    if kinds == [GraspCase]:
        case: GraspCase = given[0]
        return case if friction is None else replace(case, friction=friction)
    frictions = [*given[2:], *([] if friction is None else [friction])]
    if kinds[:2] == [Polyhedron, Grasp] and len(frictions) <= 1:
        return GraspCase(given[0], given[1], frictions[0] if frictions else USUAL_FRICTION)
    got = ", ".join(kind.__name__ for kind in kinds)
    raise InputError(
        f"{asking}: expected a grasp_case, or an object, a grasp and a friction; got {got}"
    )


def grasp_cases(folder: Path, args: Sequence[Any], settings: Mapping[str, Any]) -> list[GraspCase]:
    """Read or plan the grasps that a pytest marker asks for."""
    if len(args) > 1 or not all(isinstance(each, str) for each in args):
        raise InputError(
            f"@pytest.mark.grasp takes the path of one file of grasps, got {list(args)}"
        )
    known = ("friction", CHANGED_PART) if args else PLAN_SETTINGS
    named(settings, known, "@pytest.mark.grasp")
    friction = value_of(float, settings.get("friction", USUAL_FRICTION), "friction")
    if args:
        return _cases_of_file(folder, folder / args[0], settings)
    wanted: dict[str, Any] = {"limit": 1, **settings, "friction": friction}
    families = wanted.pop("families", None)
    name = wanted.pop("object", None)
    lengths = {each: wanted.pop(each) for each in ("unit", "scale") if each in wanted}
    if not isinstance(name, str):
        raise InputError("@pytest.mark.grasp needs the path of a grasps.json, or object=...")
    is_file = Path(name).suffix
    body = load_polyhedron(folder / name, **lengths) if is_file else example_object(name)
    try:
        grasps = plan(body, families=families, settings=PlanSettings(**wanted)).grasps
    except (TypeError, ValueError) as error:
        raise InputError(f"@pytest.mark.grasp: a setting is of the wrong kind: {error}") from error
    _check_any(grasps, body, friction)
    return [GraspCase(body, grasp, friction) for grasp in grasps]


def _cases_of_file(folder: Path, path: Path, settings: Mapping[str, Any]) -> list[GraspCase]:
    saved = load_grasps(path)
    friction = value_of(float, settings.get("friction", saved.friction), "friction")
    _check_any(saved.grasps, saved.body, friction)
    asked = IfChanged.of_table(settings.get(CHANGED_PART, {}), CHANGED_PART)
    now = present(replace(saved, friction=friction), path, [folder], asked)
    tested = {grasp.id: grasp for grasp in now.saved.grasps}
    return [
        GraspCase(now.saved.body, tested[each.id], friction, now.mesh)
        if each.id in tested
        else GraspCase(saved.body, each, friction, now.mesh, f"{each.id} is gone: "
                       f"{now.gone[each.id]}; {now.change}")
        for each in saved.grasps
    ]  # fmt: skip


def _check_any(grasps: Sequence[Grasp], body: Polyhedron, friction: float) -> None:
    if not grasps:
        raise InputError(
            f"@pytest.mark.grasp: no grasp of {body.name} was found at friction {friction:g}; try "
            "a higher friction"
        )


@declared
class Demands(Settings):
    """What a test demands of a grasp, beside holding the usual wrenches.

    Raises:
        InputError: A number is missing or out of range, or a pass rate is given without repeats.
    """

    agenda: Annotated[Agenda, CHOSEN] = field(default_factory=Agenda)
    """Which trials the grasp goes through; a test gives those of `TRIALS` by their names."""
    min_pass_rate: Share = 0.0
    """Least share of the repeats with noise in which the grasp must hold."""
    min_margin: Annotated[float, Interval(ge=0.0, le=LARGEST_FRICTION)] = 0.0
    """Least difference between the friction and the critical one, both predicted and simulated."""
    setup: Setup = field(default_factory=Setup)

    def _check_together(self) -> None:
        if self.min_pass_rate > 0.0 and not self.agenda.repeats:
            raise InputError(
                "min_pass_rate is a share of repeats with noise: give their number as `repeats`"
            )


def demands_of(asked: Mapping[str, Any]) -> Demands:
    """Build the demands from the arguments of a test."""
    given = named(asked, (*TRIALS, *for_users(Demands)), "assert_stable")
    agenda = Agenda(**{name: given.pop(name) for name in TRIALS if name in given})
    return Demands(agenda=agenda, **given)


def checked(case: GraspCase, demands: Demands) -> tuple[Verdict, str]:
    """Simulate a grasp, and say in what it falls short of the demands."""
    verdict = validate(
        case.body, case.grasp, case.friction, agenda=demands.agenda, setup=demands.setup
    )
    said, lacking = check.unstable(verdict), list(_lacking(verdict, demands))
    if lacking and not said:
        said = f"{verdict.id} at friction {verdict.friction}: less than is asked for"
    return verdict, "\n  ".join([said, *lacking])


def _lacking(verdict: Verdict, demands: Demands) -> Iterator[str]:
    found = verdict.robustness
    if found is not None and found.held < demands.min_pass_rate * len(found.trials):
        lower, upper = found.interval
        yield (
            f"with noise {found.held} of {len(found.trials)} held ({lower:.3g} to {upper:.3g} of "
            f"all with 95 % confidence), asked for are {demands.min_pass_rate:g}"
        )
    critical = verdict.critical_friction
    for how, value in (("predicted", critical.predicted), ("simulated", critical.simulated)):
        if value is not None and verdict.friction - value < demands.min_margin:
            yield (
                f"friction {verdict.friction:g} is less than {demands.min_margin:g} above the "
                f"{how} critical one, {value:.6g}"
            )


def survival(
    given: Sequence[Any], friction: float | None, settings: ExecutionSettings | None
) -> tuple[GraspCase, ExecutedGrasp, str]:
    """Execute a grasp, and say why it does not survive."""
    if settings is None and given:
        given, settings = given[:-1], given[-1]
    if not isinstance(settings, ExecutionSettings):
        raise InputError(
            f"assert_survives: expected ExecutionSettings as `settings`, got {settings!r}; give "
            "sim_validate.ExecutionSettings(...)"
        )
    case = case_of(given, friction, "assert_survives")
    found = executed_grasp(ExecutionJob(case.body, case.grasp, case.friction, settings))
    return case, found, check.not_survived(found)
