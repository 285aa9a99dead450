"""A pytest plugin: grasps of `*.grasps.toml` files as tests, and `assert_stable` for those in code.

Nothing but pytest is imported until such a file or the fixture is used.
"""

from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from sim_validate.baselines.comparing import Finding
    from sim_validate.baselines.suite import Suite
    from sim_validate.grasp_verdict import Verdict

ENDING = ".grasps.toml"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the plugin's options."""
    group = parser.getgroup("graspproof", "stability of grasps")
    group.addoption(
        "--grasp-bless",
        action="store_true",
        help="make what is measured now the baselines of *.grasps.toml files",
    )


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Take files of grasps for tests."""
    if not file_path.name.endswith(ENDING):
        return None
    kind: Any = GraspsFile  # pytest leaves the types of its constructors open
    return kind.from_parent(parent, path=file_path)


class GraspsFile(pytest.File):
    """Grasps that must stay as they were."""

    def collect(self) -> Iterator[pytest.Item]:
        """A test for each grasp; a single one where a baseline is to be written."""
        from grasp_core.errors import GraspError
        from sim_validate.baselines.suite import suite_from_toml

        try:
            suite = suite_from_toml(self.path)
            names = ["bless"] if self.config.getoption("--grasp-bless") else suite.ids()
        except GraspError as error:
            raise self.CollectError(str(error)) from error
        kind: Any = BlessItem if self.config.getoption("--grasp-bless") else GraspItem
        for name in names:
            yield kind.from_parent(self, name=name, suite=suite)


class _SuiteItem(pytest.Item):
    def __init__(self, *, suite: "Suite", **more: Any) -> None:
        super().__init__(**more)  # pyright: ignore[reportUnknownMemberType] - pytest's own
        self.suite = suite

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        """What is wrong, without a traceback through ours."""
        from grasp_core.errors import GraspError

        if isinstance(excinfo.value, UnstableError | GraspError):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, None, str]:
        """Where a test is, and what it is called."""
        return self.path, None, f"{self.path.name}: {self.name}"


class GraspItem(_SuiteItem):
    """One grasp, simulated and compared with its baseline."""

    def runtest(self) -> None:
        """Fail where the grasp is worse, missing or new, or cannot be compared."""
        from sim_validate.baselines.comparing import FAILED, Status

        finding = self.suite.finding(self.name)
        self.user_properties.append(("status", finding.status.value))
        if finding.after is not None:
            self.user_properties += list(asdict(finding.after).items())
        better = (Status.IMPROVED,) if self.suite.strict else ()
        failing = (*FAILED, Status.NOT_COMPARABLE, *better)
        if finding.status in failing:
            raise UnstableError(_explained(finding, self.suite.baseline))


class BlessItem(_SuiteItem):
    """All grasps of a file, simulated to make a baseline."""

    def runtest(self) -> None:
        """Write the baseline."""
        found = self.suite.bless()
        self.user_properties.append(("grasps", len(found.entries)))


class UnstableError(AssertionError):
    """A grasp is not as stable as it must be."""


def _explained(finding: "Finding", baseline: Path) -> str:
    """What became of a grasp: predicted, simulated, baseline, and how to see it again."""
    lines = [f"{finding.id}: {finding.status.value}", *(f"  {why}" for why in finding.reasons)]
    for title, entry in (("baseline", finding.before), ("now", finding.after)):
        if entry is None:
            continue
        failed = f" at {entry.first_failure}" if entry.first_failure else ""
        simulated = _number(entry.simulated_critical_friction)
        lines += [
            f"  {title}: {entry.outcome}{failed}, moved {entry.displacement_m:.3g} m",
            f"    critical friction {entry.critical_friction:.6g} predicted, {simulated} simulated",
            f"    weakest wrench {entry.limit_n:.6g} N predicted, "
            f"{_number(entry.simulated_limit_n)} simulated",
        ]
    lines.append(f"  graspproof baseline check {baseline}  # pytest --grasp-bless accepts it")
    return "\n".join(lines)


def _number(value: float | None) -> str:
    return "not measured" if value is None else f"{value:.6g}"


@pytest.fixture
def assert_stable(
    record_property: Callable[[str, object], None],
) -> Callable[..., "Verdict"]:
    """A function that simulates a grasp and fails the test unless it holds as predicted."""

    def check(body: Any, grasp: Any, friction: float = 0.5, **settings: Any) -> "Verdict":
        """Simulate a grasp with its negative controls.

        Args:
            body: The object.
            grasp: On its faces.
            friction: Coulomb coefficient.
            settings: `agenda` and `setup`, as `sim_validate.validate` takes them.

        Raises:
            UnstableError: A wrench was not held, a control was, or the analysis is contradicted.
        """
        from sim_validate.validation import validate

        verdict = validate(body, grasp, friction, **settings)
        record_property(f"{grasp.id}.outcome", verdict.outcome.value)
        record_property(f"{grasp.id}.critical_friction", verdict.critical_friction.predicted)
        simulated = verdict.critical_friction.simulated
        record_property(f"{grasp.id}.simulated_critical_friction", simulated)
        if not verdict.good:
            raise UnstableError(_why(verdict))
        return verdict

    return check


def _why(verdict: "Verdict") -> str:
    """What did not hold, or held and must not."""
    lines = [f"{verdict.id} at friction {verdict.friction}: {verdict.outcome.value}"]
    for trial in verdict.wrenches:
        if trial.hold.outcome.value != "held":
            lines.append(
                f"  {trial.name} {trial.wrench.tolist()}: {trial.hold.outcome.value} "
                f"({trial.hold.reason}), predicted limit {trial.predicted_limit:.4g} times it"
            )
            break
    lines += [f"  control {each.control.name} held" for each in verdict.controls if each.held]
    lines += [f"  {text}" for text in verdict.mismatches]
    return "\n".join(lines)
