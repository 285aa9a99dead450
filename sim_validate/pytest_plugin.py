"""A pytest plugin: `*.grasps.toml` files become tests, and fixtures check single grasps.

Nothing but pytest is imported until such a file, the fixtures or the marker are used.
"""

from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from sim_validate.baselines.part import Source
    from sim_validate.baselines.suite import Suite
    from sim_validate.closure.verdict import Verdict
    from sim_validate.execution.verdict import Execution

ENDING = ".grasps.toml"
MARKER = (
    "grasp([file], *, object=None, friction=0.5, limit=1, families, cones, seed, unit): run the "
    "test with each grasp of a grasps.json, or planned for an object, as its fixture `grasp_case`"
)
LINES = pytest.StashKey[list[dict[str, str]]]()
"""What the terminal says about grasps at the end, kept for a phase of a test and the whole run."""
MOST_TOLD = 40
TRAVELS = "_graspproof"
"""Name of the attribute that carries these lines on pytest's reports between processes."""


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
    """Register the `grasp` marker, and prepare to collect the lines about grasps from all tests."""
    config.addinivalue_line("markers", MARKER)
    config.stash[LINES] = []
    config.pluginmanager.register(_Collecting(config))


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Collect `*.grasps.toml` files as tests."""
    if not file_path.name.endswith(ENDING):
        return None
    kind: Any = GraspsFile  # pytest leaves the types of its constructors open
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


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item,
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Attach the lines about grasps to pytest's report on a test."""
    report = yield
    if lines := item.stash.get(LINES, None):
        setattr(report, TRAVELS, lines)
        del item.stash[LINES]
    return report


class _Collecting:
    def __init__(self, config: pytest.Config) -> None:
        self._lines = config.stash[LINES]

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Take the lines of one test, run here or in another process."""
        self._lines += getattr(report, TRAVELS, [])

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """List meshes that are not the planned ones, what passed on them, and new baselines."""
        if not self._lines:
            return
        for title, texts in sections(self._lines):
            terminalreporter.section(title)
            for text in texts:
                terminalreporter.write_line(text)


def sections(lines: Sequence[dict[str, str]]) -> list[tuple[str, list[str]]]:
    """Write what the terminal says at the end: titles, each with at least one line.

    A grasp has a line here only if it passes and is not what it was; failures speak for themselves.
    """
    notes = sorted({line["mesh_note"] for line in lines if line["mesh_note"]})
    meshes = [text for note in notes for text in (note, *_told(lines, note, "  "))]
    found = [
        ("meshes of grasps", meshes),
        ("grasps that are better", _told(lines, "", "")),
        ("baselines of grasps", sorted({line["wrote"] for line in lines if line["wrote"]})),
    ]
    return [(title, texts) for title, texts in found if texts]


def _told(lines: Sequence[dict[str, str]], note: str, indent: str) -> list[str]:
    said = sorted({line["told"] for line in lines if line["told"] and line["mesh_note"] == note})
    more = len(said) - MOST_TOLD
    cut = [f"and {more} more; --junitxml FILE lists all"] if more > 0 else []
    return [f"{indent}{text}" for text in (*said[:MOST_TOLD], *cut)]


class GraspsFile(pytest.File):
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
        files, same = (suite.baseline, suite.grasps), finding.status is Status.SAME
        why = "" if same else explained(done, files, suite.compared)
        fails = finding.status in (*failing(strict=suite.strict), Status.NOT_COMPARABLE)
        told = "" if fails else passing(done, suite.compared)
        _note(self, "status", finding.status.value, suite.compared.mesh, told=told)
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
        self.user_properties.append(("grasps", len(found.entries)))
        for name in now.gone:
            _note(self, f"{name}.status", "gone", now.mesh)
        wrote = written(self.suite.baseline, found, now)
        for entry in found.entries:
            _note(self, f"{entry.id}.status", "blessed", now.mesh, wrote=wrote)


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
        from sim_validate.baselines.baseline import Entry
        from sim_validate.baselines.suite import case_of, checked, demands_of

        chosen = case_of(case, friction)
        verdict, why = checked(chosen, demands_of(asked))
        figures = Entry.of(verdict).properties()
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
    item: pytest.Item, name: str, status: str, figures: Mapping[str, object], source: "Source",
    why: str,
) -> None:  # fmt: skip
    """Keep what a test found out about a grasp, and fail if that is not as it must be."""
    item.user_properties += [(f"{name}.{key}", value) for key, value in figures.items()]
    _note(item, f"{name}.status", status, source)
    if why:
        raise UnstableError(why)


def _note(
    item: pytest.Item, name: str, status: str, source: "Source | None" = None, *,
    told: str = "", wrote: str = "",
) -> None:  # fmt: skip
    """Keep the status of a grasp as a property of its test, and what the terminal says at the end.

    Takes `name` of the property, `told` of a grasp that passes, `wrote` of a new baseline.
    """
    note = "" if source is None else source.note
    item.user_properties += [(name, status), *([("mesh_note", note)] if note else [])]
    item.stash.setdefault(LINES, []).append({"told": told, "wrote": wrote, "mesh_note": note})
