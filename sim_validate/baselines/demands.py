"""Reads or plans the grasps of a pytest test, and checks that they are as stable as it demands."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

from grasp_core.declared import Declared
from grasp_core.errors import InputError
from grasp_core.kinds import LARGEST_FRICTION, Range, Share, value_of
from grasp_core.objects.polyhedron import Polyhedron, load_polyhedron
from grasp_core.planning.planner import plan
from grasp_core.records.grasps_json import load_grasps
from grasp_core.settings import CHOSEN, Settings, for_users, named
from grasp_core.values import Grasp
from scenes.example_objects import example_object
from sim_validate.baselines.check import not_survived, unstable
from sim_validate.baselines.part import TABLE, IfChanged, Source, present, source_of
from sim_validate.closure.validate import validate
from sim_validate.closure.verdict import Verdict
from sim_validate.engine.setup import Agenda, Setup
from sim_validate.execution.execute import ExecutionJob, executed_grasp
from sim_validate.execution.verdict import ExecutedGrasp
from sim_validate.settings import ExecutionSettings

FRICTION = 0.5
TRIALS = ("wrenches", "repeats", "noise", "random_wrenches", "seed")
"""Settings of an agenda that a test may give by their names."""
SETTINGS = ("object", "friction", "limit", "families", "cones", "seed", "unit", "scale")


@dataclass(frozen=True, slots=True, eq=False)
class GraspCase(Declared):
    """A grasp on its object, and the friction at which to test it."""

    body: Polyhedron
    grasp: Grasp
    friction: float
    source: Source = field(default_factory=Source)
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
        return GraspCase(given[0], given[1], frictions[0] if frictions else FRICTION)
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
    known = ("friction", TABLE) if args else SETTINGS
    named(settings, known, "@pytest.mark.grasp")
    friction = value_of(float, settings.get("friction", FRICTION), "friction")
    if args:
        return _cases_of_file(folder, folder / args[0], settings)
    wanted: dict[str, Any] = {"limit": 1, **settings, "friction": friction}
    name = wanted.pop("object", None)
    lengths = {each: wanted.pop(each) for each in ("unit", "scale") if each in wanted}
    if not isinstance(name, str):
        raise InputError("@pytest.mark.grasp needs the path of a grasps.json, or object=...")
    is_file = Path(name).suffix
    body = load_polyhedron(folder / name, **lengths) if is_file else example_object(name)
    try:
        grasps = plan(body, **wanted).grasps
    except (TypeError, ValueError) as error:
        raise InputError(f"@pytest.mark.grasp: a setting is of the wrong kind: {error}") from error
    _check_any(grasps, body, friction)
    return [GraspCase(body, grasp, friction) for grasp in grasps]


def _cases_of_file(folder: Path, path: Path, settings: Mapping[str, Any]) -> list[GraspCase]:
    saved = load_grasps(path)
    friction = value_of(float, settings.get("friction", saved.friction), "friction")
    _check_any(saved.grasps, saved.body, friction)
    asked = IfChanged.of_table(settings.get(TABLE, {}), TABLE)
    source = source_of(saved, path, [folder], scale=asked.scale)
    now = present(replace(saved, friction=friction), path, source, asked)
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


@dataclass(frozen=True, slots=True)
class Demands(Settings):
    """What a test demands of a grasp, beside holding the usual wrenches.

    Raises:
        InputError: A number is missing or out of range, or a pass rate is given without repeats.
    """

    agenda: Annotated[Agenda, CHOSEN] = field(default_factory=Agenda)
    """Which trials the grasp goes through; a test gives those of `TRIALS` by their names."""
    min_pass_rate: Share = 0.0
    """Least share of the repeats with noise in which the grasp must hold."""
    min_margin: Annotated[float, Range(least=0.0, most=LARGEST_FRICTION)] = 0.0
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
    said, lacking = unstable(verdict), list(_lacking(verdict, demands))
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
    return case, found, not_survived(found)
