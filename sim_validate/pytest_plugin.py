"""A pytest plugin: `*.grasps.toml` files become tests, and fixtures check single grasps.

Nothing but pytest is imported until such a file, the fixtures or the marker are used.
"""

from collections.abc import Callable, Generator, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from sim_validate.baselines.part import Source
    from sim_validate.baselines.suite import Suite
    from sim_validate.execution.verdict import Execution
    from sim_validate.validation.grasp_verdict import Verdict

    Entries = tuple[dict[str, Any] | None, dict[str, Any] | None]

ENDING = ".grasps.toml"
MARKER = (
    "grasp([file], *, object=None, friction=0.5, limit=1, families, cones, seed, unit): run the "
    "test with each grasp of a grasps.json, or planned for an object, as its fixture `grasp_case`"
)
LINES = pytest.StashKey[list[dict[str, Any]]]()
"""Lines of the report about grasps, kept for one phase of a test and for the whole run."""
TRAVELS = "_graspproof"
"""Name of the attribute that carries these lines on pytest's reports between processes."""
FOR_TERMINAL = ("told", "wrote")
"""Parts of a line that only the terminal shows."""


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
    group.addoption(
        "--grasp-report",
        metavar="DIR",
        help="write what became of every grasp to DIR/index.html and DIR/report.json",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Register the `grasp` marker, and prepare to collect report lines from all tests."""
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
    from sim_validate.baselines.demands import grasp_cases

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


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session: pytest.Session) -> None:
    """Write the report in the process that collected the results of all others."""
    folder = session.config.getoption("--grasp-report")
    if folder is None or hasattr(session.config, "workerinput"):
        return
    from sim_validate.reports.stability_page import write_report

    lines = session.config.stash[LINES]
    write_report(Path(folder), [
        {name: said for name, said in line.items() if name not in FOR_TERMINAL} for line in lines
    ])  # fmt: skip


class _Collecting:
    """Collects the lines about grasps from all tests."""

    def __init__(self, config: pytest.Config) -> None:
        self._lines = config.stash[LINES]

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Take the lines of one test, run here or in another process."""
        self._lines += getattr(report, TRAVELS, [])

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """List meshes that are not the planned ones, what passed on them, and new baselines."""
        if not self._lines:
            return
        from sim_validate.reports.terminal_lines import sections

        for title, texts in sections(self._lines):
            terminalreporter.section(title)
            for text in texts:
                terminalreporter.write_line(text)


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
        from sim_validate.baselines.baseline import plain, properties_of
        from sim_validate.baselines.compare import Status, failing
        from sim_validate.baselines.explain import explained, passing
        from sim_validate.baselines.part import ChangedPartError

        suite = self.suite
        try:
            done = suite.tested(self.name)
        except GraspError as error:
            changed = isinstance(error, ChangedPartError)
            _note(self, self.name, "not comparable" if changed else "refused", str(error))
            raise
        (finding,) = done.findings
        files, same = (suite.baseline, suite.grasps), finding.status is Status.SAME
        why = "" if same else explained(done, files, suite.compared)
        before, after = plain(finding.before), plain(finding.after)
        self.user_properties.append(("status", finding.status.value))
        self.user_properties += properties_of(after or {}).items()
        fails = finding.status in (*failing(strict=suite.strict), Status.NOT_COMPARABLE)
        entries, mesh = (before, after), suite.compared.mesh
        line = _note(self, finding.id, finding.status.value, why, entries, mesh)
        line["told"] = "" if fails else passing(done, suite.compared)
        if fails:
            raise UnstableError(f"{why}\n  to accept the change: pytest --grasp-bless {self.path}")


class BlessItem(_SuiteItem):
    """The test that simulates all grasps of a file and makes them its baseline."""

    def runtest(self) -> None:
        """Simulate all grasps and write the baseline."""
        from sim_validate.baselines.baseline import plain
        from sim_validate.baselines.explain import written

        found = self.suite.bless()
        self.user_properties.append(("grasps", len(found.entries)))
        for name, why in self.suite.present.gone.items():
            _note(self, name, "gone", why, source=self.suite.present.mesh)
        for entry in found.entries:
            entries, mesh = (None, plain(entry)), self.suite.present.mesh
            line = _note(self, entry.id, "blessed", "", entries, mesh)
            line["wrote"] = written(self.suite.baseline, found, self.suite.present)


@pytest.fixture
def grasp_case(request: pytest.FixtureRequest) -> Any:
    """The grasp, object and friction that a test marked with `grasp` is run with."""
    if not hasattr(request, "param"):
        pytest.fail(f"{request.node.name}: grasp_case needs @pytest.mark.grasp(...)", pytrace=False)
    if request.param.gone:
        _note(request.node, request.param.grasp.id, "gone", request.param.gone)
        pytest.fail(request.param.gone, pytrace=False)
    return request.param


@pytest.fixture
def assert_stable(
    request: pytest.FixtureRequest, record_property: Callable[[str, object], None]
) -> Callable[..., "Verdict"]:
    """A function that simulates a grasp and fails the test unless it holds as predicted."""

    def check(*case: Any, friction: float | None = None, **asked: Any) -> "Verdict":
        """Simulate a grasp with its negative controls."""
        from sim_validate.baselines.baseline import entry_of, plain
        from sim_validate.baselines.demands import case_of, checked, demands_of

        chosen = case_of(case, friction)
        verdict, why = checked(chosen, demands_of(asked))
        name = chosen.grasp.id
        entry = plain(entry_of(chosen.grasp, verdict, chosen.body.radius)) or {}
        for key, value in entry.items():
            record_property(f"{name}.{key}", value)
        status = "unstable" if why else "stable"
        _note(request.node, name, status, why, (None, entry), chosen.source)
        if why:
            raise UnstableError(why)
        return verdict

    return check


@pytest.fixture
def assert_survives(
    request: pytest.FixtureRequest, record_property: Callable[[str, object], None]
) -> Callable[..., "Execution"]:
    """A function that executes a grasp and fails the test unless the object survives."""

    def check(*case: Any, settings: Any = None, friction: float | None = None) -> "Execution":
        """Execute a grasp with its negative controls."""
        from sim_validate.baselines.baseline import execution_entry
        from sim_validate.baselines.demands import survival

        chosen, found, why = survival(case, friction, settings)
        for key, value in asdict(execution_entry(found)).items():
            record_property(f"{found.id}.execution.{key}", value)
        _note(request.node, found.id, "lost" if why else "survived", why, source=chosen.source)
        if why or found.execution is None:
            raise UnstableError(why)
        return found.execution

    return check


def _note(
    item: pytest.Item, grasp: str, status: str, why: str, entries: "Entries" = (None, None),
    source: "Source | None" = None,
) -> dict[str, Any]:  # fmt: skip
    """Remember the outcome of a grasp in a test, with its entries before and after."""
    file, note = (None, "") if source is None else (source.file, source.note)
    line: dict[str, Any] = {
        "test": item.nodeid, "grasp": grasp, "status": status, "why": why, "before": entries[0],
        "after": entries[1], "mesh_file": None if file is None else str(file), "mesh_note": note,
        "told": "", "wrote": "",
    }  # fmt: skip
    item.stash.setdefault(LINES, []).append(line)
    return line
