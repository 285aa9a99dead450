"""A pytest plugin: `*.grasps.toml` files become tests, and fixtures check single grasps.

Nothing but pytest is imported until such a file, the fixtures or the marker are used.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import pytest

if TYPE_CHECKING:
    from sim_validate.baselines.part import SourceMesh
    from sim_validate.baselines.suite import Suite
    from sim_validate.closure.verdict import Verdict
    from sim_validate.execution.verdict import Execution

ENDING = ".grasps.toml"
MARKER = (
    "grasp([file], *, object=None, friction=0.5, limit=1, families, cones, seed, unit): run the "
    "test with each grasp of a grasps.json, or planned for an object, as its fixture `grasp_case`"
)
NOTE, TOLD_AT_END, WROTE = "mesh_note", "grasp_change", "baseline_written"
"""Properties of tests that the terminal shows at the end: pytest carries them between processes."""
MOST_TOLD = 40
Properties: TypeAlias = Sequence[tuple[str, object]]


class UnstableError(AssertionError):
    """Error for a grasp that is not as stable as it must be."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the plugin's options to pytest."""
    group = parser.getgroup("graspproof", "stability of grasps")
    group.addoption(
        "--grasp-bless",
        action="store_true",
        help="make what is measured now the baselines of *.grasps.toml files",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Register the `grasp` marker."""
    config.addinivalue_line("markers", MARKER)


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Collect `*.grasps.toml` files as tests."""
    if not file_path.name.endswith(ENDING):
        return None
    kind: Any = GraspSuiteFile  # pytest leaves the types of its constructors open
    return kind.from_parent(parent, path=file_path)


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Run a marked test with each of its grasps."""
    marker = metafunc.definition.get_closest_marker("grasp")
    if marker is None or "grasp_case" not in metafunc.fixturenames:
        return
    from grasp_core.errors import GraspError
    from sim_validate.baselines.suite import grasp_cases

    wrong = ""
    try:
        cases = grasp_cases(metafunc.definition.path.parent, marker.args, marker.kwargs)
        names = [case.grasp.id for case in cases]
        metafunc.parametrize("grasp_case", cases, ids=names, indirect=True)
    except GraspError as error:
        wrong = str(error)
    if wrong:  # outside, so that the report shows it once
        pytest.fail(wrong, pytrace=False)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """List meshes that are not the planned ones, what passed on them, and new baselines."""
    reports = chain.from_iterable(terminalreporter.stats.values())
    kept = [each.user_properties for each in reports if isinstance(each, pytest.TestReport)]
    for title, texts in sections(kept):
        terminalreporter.section(title)
        for text in texts:
            terminalreporter.write_line(text)


def sections(kept: Sequence[Properties]) -> list[tuple[str, list[str]]]:
    """Write what the terminal says at the end: titles, each with at least one line.

    Takes the properties that tests have kept. A grasp has a line here only if it passes and is not
    what it was; failures speak for themselves.
    """
    notes, wrote = (
        sorted({str(value) for each in kept for name, value in each if name == wanted})
        for wanted in (NOTE, WROTE)
    )
    meshes = [text for note in notes for text in (note, *_told(kept, note, "  "))]
    found = [
        ("meshes of grasps", meshes),
        ("grasps that are better", _told(kept, "", "")),
        ("baselines of grasps", wrote),
    ]
    return [(title, texts) for title, texts in found if texts]


def _told(kept: Sequence[Properties], note: str, indent: str) -> list[str]:
    of_note = [given for given in map(dict, kept) if given.get(NOTE, "") == note]
    said = sorted({str(given[TOLD_AT_END]) for given in of_note if TOLD_AT_END in given})
    more = len(said) - MOST_TOLD
    cut = [f"and {more} more; --junitxml FILE lists all"] if more > 0 else []
    return [f"{indent}{text}" for text in (*said[:MOST_TOLD], *cut)]


class GraspSuiteFile(pytest.File):
    """A `*.grasps.toml` file: which grasps must stay as stable as they were."""

    def collect(self) -> Iterator[pytest.Item]:
        """Yield a test for each grasp, or a single one if a baseline is to be written."""
        from grasp_core.errors import GraspError
        from sim_validate.baselines.suite import suite_from_toml

        bless = self.config.getoption("--grasp-bless")
        try:
            suite = suite_from_toml(self.path)
            names = ["bless"] if bless else suite.ids
        except GraspError as error:
            raise self.CollectError(str(error)) from error
        kind: Any = BlessItem if bless else GraspItem
        for name in names:
            yield kind.from_parent(self, name=name, suite=suite)


class _SuiteItem(pytest.Item):
    def __init__(self, *, suite: "Suite", **more: Any) -> None:
        super().__init__(**more)  # pyright: ignore[reportUnknownMemberType] - pytest's own
        self.suite = suite

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        """Show what is wrong, without a traceback through the plugin's own code."""
        from grasp_core.errors import GraspError

        if isinstance(excinfo.value, UnstableError | GraspError):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, None, str]:
        """The file of a test, and its name."""
        return self.path, None, f"{self.path.name}: {self.name}"


class GraspItem(_SuiteItem):
    """The test of one grasp, simulated and compared with its baseline."""

    def runtest(self) -> None:
        """Fail if the grasp is worse, gone, missing or new, or cannot be compared."""
        from grasp_core.errors import GraspError
        from sim_validate.baselines.check import explained, passing
        from sim_validate.baselines.compare import Status, failing
        from sim_validate.baselines.part import ChangedPartError

        suite = self.suite
        try:
            done = suite.tested(self.name)
        except GraspError as error:
            changed = isinstance(error, ChangedPartError)
            _note(self, "status", "not comparable" if changed else "refused")
            raise
        (finding,) = done.findings
        why = "" if finding.status is Status.SAME else explained(done)
        fails = finding.status in (*failing(strict=suite.strict), Status.NOT_COMPARABLE)
        _note(self, "status", finding.status.value, suite.compared.mesh)
        if not fails and (told := passing(done)):
            self.user_properties.append((TOLD_AT_END, told))
        if finding.after is not None:
            self.user_properties += finding.after.properties().items()
        if fails:
            raise UnstableError(f"{why}\n  to accept the change: pytest --grasp-bless {self.path}")


class BlessItem(_SuiteItem):
    """The test that simulates all grasps of a file and makes them its baseline."""

    def runtest(self) -> None:
        """Simulate all grasps and write the baseline."""
        from sim_validate.baselines.check import written

        found, now = self.suite.bless(), self.suite.present
        wrote = written(self.suite.baseline, found, now)
        self.user_properties += [("grasps", len(found.entries)), (WROTE, wrote)]
        for name in now.gone:
            _note(self, f"{name}.status", "gone", now.mesh)
        for entry in found.entries:
            _note(self, f"{entry.id}.status", "blessed", now.mesh)


@pytest.fixture
def grasp_case(request: pytest.FixtureRequest) -> Any:
    """The grasp, object and friction that a test marked with `grasp` is run with."""
    if not hasattr(request, "param"):
        pytest.fail(f"{request.node.name}: grasp_case needs @pytest.mark.grasp(...)", pytrace=False)
    if request.param.gone:
        _note(request.node, f"{request.param.grasp.id}.status", "gone")
        pytest.fail(request.param.gone, pytrace=False)
    return request.param


@pytest.fixture
def assert_stable(request: pytest.FixtureRequest) -> Callable[..., "Verdict"]:
    """A function that simulates a grasp and fails the test unless it holds as predicted."""

    def check(*case: Any, friction: float | None = None, **asked: Any) -> "Verdict":
        """Simulate a grasp with its negative controls."""
        from sim_validate.baselines.baseline import KeptGrasp
        from sim_validate.baselines.suite import case_of, checked, demands_of

        chosen = case_of(case, friction)
        verdict, why = checked(chosen, demands_of(asked))
        figures = KeptGrasp.of(verdict).properties()
        status = "unstable" if why else "stable"
        _require(request.node, chosen.grasp.id, status, figures, chosen.source, why)
        return verdict

    return check


@pytest.fixture
def assert_survives(request: pytest.FixtureRequest) -> Callable[..., "Execution"]:
    """A function that executes a grasp and fails the test unless the object survives."""

    def check(*case: Any, settings: Any = None, friction: float | None = None) -> "Execution":
        """Execute a grasp with its negative controls."""
        from grasp_core.files.records import record_of
        from sim_validate.baselines.baseline import ExecutedFigures
        from sim_validate.baselines.suite import survival

        chosen, found, why = survival(case, friction, settings)
        kept = record_of(ExecutedFigures.of(found))
        figures = {f"execution.{key}": value for key, value in kept.items()}
        _require(request.node, found.id, "lost" if why else "survived", figures, chosen.source, why)
        assert found.execution is not None  # noqa: S101 - else it says why
        return found.execution

    return check


def _require(
    item: pytest.Item, name: str, status: str, figures: Mapping[str, object], source: "SourceMesh",
    why: str,
) -> None:  # fmt: skip
    item.user_properties += [(f"{name}.{key}", value) for key, value in figures.items()]
    _note(item, f"{name}.status", status, source)
    if why:
        raise UnstableError(why)


def _note(item: pytest.Item, name: str, status: str, source: "SourceMesh | None" = None) -> None:
    """Keep the status of a grasp as a property of its test, and what must be known of its mesh."""
    item.user_properties.append((name, status))
    if source is not None and source.note:
        item.user_properties.append((NOTE, source.note))
