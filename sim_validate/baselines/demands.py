"""Checks whether a grasp is as stable as a test demands, or survives as a test demands."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

from grasp_core.checked import LARGEST_FRICTION
from grasp_core.errors import InputError
from sim_validate.baselines.executions import not_survived
from sim_validate.baselines.explain import unstable
from sim_validate.baselines.grasp_cases import GraspCase, case_of
from sim_validate.execution.jobs import ExecutionJob, executed_grasp
from sim_validate.execution.settings import ExecutionSettings
from sim_validate.execution.verdict import ExecutedGrasp
from sim_validate.simulation.setup import Agenda, NamedWrench, Noise, Setup
from sim_validate.validation.validation import validate
from sim_validate.validation.verdict import Verdict


@dataclass(frozen=True, slots=True)
class Demands:
    """What a test demands of a grasp, beside holding the usual wrenches.

    Raises:
        InputError: A number is missing or out of range, or a pass rate is given without repeats.
    """

    wrenches: Sequence[NamedWrench] = ()
    """Wrenches that the grasp must hold in full."""
    trials: int = 0
    """Number of repeats with noise."""
    noise: Noise = field(default_factory=Noise)
    min_pass_rate: float = 0.0
    """Least share of the repeats with noise in which the grasp must hold."""
    min_margin: float = 0.0
    """Least difference between the friction and the critical one, both predicted and simulated."""
    random_wrenches: int = 0
    seed: int = 0
    setup: Setup = field(default_factory=Setup)
    """How trials are simulated."""

    def __post_init__(self) -> None:
        for name, most in (("min_pass_rate", 1.0), ("min_margin", LARGEST_FRICTION)):
            value = getattr(self, name)
            if not (isinstance(value, int | float) and 0.0 <= value <= most):
                raise InputError(f"{name} must be from 0 to {most:g}, got {value!r}")
        if self.min_pass_rate > 0.0 and not self.trials:
            raise InputError(
                "min_pass_rate is a share of repeats with noise: give their number as `trials`, too"
            )
        for each in self.wrenches:
            if not isinstance(each, NamedWrench):  # pyright: ignore[reportUnnecessaryIsInstance]
                raise InputError(f"wrenches must be NamedWrench values, got {each!r}")


def demands_of(asked: Mapping[str, Any]) -> Demands:
    """Build the demands from the arguments of a test."""
    known = [each.name for each in fields(Demands)]
    for name in asked:
        if name not in known:
            raise InputError(f"assert_stable has no argument {name!r}; it takes {', '.join(known)}")
    return Demands(**asked)


def checked(case: GraspCase, demands: Demands) -> tuple[Verdict, str]:
    """Simulate a grasp, and say in what it falls short of the demands.

    Gives the verdict, and sentences on what the grasp lacks, empty if it meets all demands.
    """
    agenda = Agenda(
        random_wrenches=demands.random_wrenches,
        wrenches=tuple(demands.wrenches),
        trials=demands.trials,
        noise=demands.noise,
        seed=demands.seed,
    )
    verdict = validate(case.body, case.grasp, case.friction, agenda=agenda, setup=demands.setup)
    said, lacking = unstable(verdict), list(_lacking(verdict, demands))
    if lacking and not said:
        said = f"{verdict.id} at friction {verdict.friction}: less than is asked for"
    return verdict, "\n  ".join([said, *lacking])


def _lacking(verdict: Verdict, demands: Demands) -> Iterator[str]:
    """Yield the demands that are not met."""
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
    """Execute a grasp, and say why it does not survive.

    Gives the case, its execution, and sentences on what went wrong, empty if the object survived.
    """
    if settings is None and given:
        given, settings = given[:-1], given[-1]
    if not isinstance(settings, ExecutionSettings):
        raise InputError(
            f"assert_survives: expected ExecutionSettings as `settings`, got {settings!r}; give "
            "sim_validate.ExecutionSettings(mass_kg=...)"
        )
    case = case_of(given, friction, "assert_survives")
    found = executed_grasp(ExecutionJob(case.body, case.grasp, case.friction, settings))
    return case, found, not_survived(found)
