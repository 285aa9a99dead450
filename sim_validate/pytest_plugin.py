"""A pytest plugin: grasps of `*.grasps.toml` files as tests, and `assert_stable` for those in code.

Nothing but pytest is imported until such a file, the fixtures or the marker are used.
"""

from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from sim_validate.baselines.source_file import Source
    from sim_validate.baselines.suite_toml import Suite
    from sim_validate.validation.grasp_verdict import Verdict

    Entries = tuple[dict[str, Any] | None, dict[str, Any] | None]

ENDING = ".grasps.toml"
MARKER = (
    "grasp([file], *, object=None, friction=0.5, limit=1, families, cones, seed, unit): run the "
    "test with each grasp of a grasps.json, or planned for an object, as its fixture `grasp_case`"
)
LINES = pytest.StashKey[list[dict[str, Any]]]()
"""What became of grasps: in one phase of a test, and in the whole run."""
TRAVELS = "_graspproof"
"""Attribute of reports that has the same."""


class UnstableError(AssertionError):
    """A grasp is not as stable as it must be."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the plugin's options."""
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
    """Make the marker known."""
    config.addinivalue_line("markers", MARKER)
    config.stash[LINES] = []
    config.pluginmanager.register(_Collecting(config))


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Take files of grasps for tests."""
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
    from sim_validate.baselines.grasp_cases import grasp_cases

    wrong = ""
    try:
        cases = grasp_cases(metafunc.definition.path.parent, marker.args, marker.kwargs)
        metafunc.parametrize("grasp_case", cases, ids=[case.grasp.id for case in cases])
    except GraspError as error:
        wrong = str(error)
    if wrong:  # outside, so that the report shows it once
        pytest.fail(wrong, pytrace=False)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item,
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Give what became of grasps to the report, which travels between processes."""
    report = yield
    if lines := item.stash.get(LINES, None):
        setattr(report, TRAVELS, lines)
        del item.stash[LINES]
    return report


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session: pytest.Session) -> None:
    """Write the report, where all that was tested has come together."""
    folder = session.config.getoption("--grasp-report")
    if folder is None or hasattr(session.config, "workerinput"):
        return
    from sim_validate.reports.stability_page import write_report

    write_report(Path(folder), session.config.stash[LINES])


class _Collecting:
    """Brings together what became of grasps in all tests."""

    def __init__(self, config: pytest.Config) -> None:
        self._lines = config.stash[LINES]

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Take what a test, here or in another process, has to say."""
        self._lines += getattr(report, TRAVELS, [])

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Say which tests were not of a mesh file, but of a copy of it."""
        notes = sorted({line["mesh_note"] for line in self._lines if line["mesh_note"]})
        if notes:
            terminalreporter.section("meshes of grasps")
        for note in notes:
            terminalreporter.write_line(note)


class GraspsFile(pytest.File):
    """Grasps that must stay as they were."""

    def collect(self) -> Iterator[pytest.Item]:
        """A test for each grasp; a single one where a baseline is to be written."""
        from grasp_core.errors import GraspError
        from sim_validate.baselines.suite_toml import suite_from_toml

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
        from grasp_core.errors import GraspError
        from sim_validate.baselines.compare import Status, failing
        from sim_validate.baselines.entries import plain
        from sim_validate.baselines.explain import explained
        from sim_validate.baselines.source_file import ChangedPartError

        suite = self.suite
        try:
            done = suite.tested(self.name)
        except ChangedPartError as error:
            _note(self, self.name, Status.NOT_COMPARABLE.value, str(error))
            raise
        except GraspError as error:
            _note(self, self.name, "refused", str(error))
            raise
        (finding,) = done.findings
        fails = finding.status in (*failing(strict=suite.strict), Status.NOT_COMPARABLE)
        told = fails or finding.status is not Status.SAME
        files = suite.baseline, suite.grasps
        why = explained(finding, done.verdicts.get(self.name), files, done.how) if told else ""
        before, after = plain(finding.before), plain(finding.after)
        self.user_properties += [("status", finding.status.value), *(after or {}).items()]
        _note(self, finding.id, finding.status.value, why, (before, after), suite.source)
        if fails:
            raise UnstableError(f"{why}\n  to accept it: pytest --grasp-bless {self.path}")


class BlessItem(_SuiteItem):
    """All grasps of a file, simulated to make a baseline."""

    def runtest(self) -> None:
        """Write the baseline."""
        from sim_validate.baselines.entries import plain

        found = self.suite.bless()
        self.user_properties.append(("grasps", len(found.entries)))
        for entry in found.entries:
            _note(self, entry.id, "blessed", "", (None, plain(entry)), self.suite.source)


@pytest.fixture
def grasp_case(request: pytest.FixtureRequest) -> Any:
    """The grasp that a test marked with `grasp` is run with."""
    pytest.fail(f"{request.node.name}: grasp_case needs @pytest.mark.grasp(...)", pytrace=False)


@pytest.fixture
def assert_stable(
    request: pytest.FixtureRequest, record_property: Callable[[str, object], None]
) -> Callable[..., "Verdict"]:
    """A function that simulates a grasp and fails the test unless it holds as predicted."""

    def check(*case: Any, friction: float | None = None, **asked: Any) -> "Verdict":
        """Simulate a grasp with its negative controls.

        Args:
            case: A `grasp_case`; or the object, a grasp on its faces, and the friction.
            friction: Coulomb coefficient, in place of the case's, or .5.
            asked: Fields of `Demands`: `wrenches` to hold as they are, `trials` with `noise`,
                `min_pass_rate` of them, `min_margin` of the friction over the critical one,
                `random_wrenches`, `seed`, `setup`.

        Raises:
            UnstableError: A wrench was not held, a control was, the analysis is contradicted, or
                less is reached than is asked for.
            InputError: The grasp or what is asked for is refused.
        """
        from sim_validate.baselines.demands import checked, demands_of
        from sim_validate.baselines.entries import entry_of, plain
        from sim_validate.baselines.grasp_cases import case_of

        chosen = case_of(case, friction)
        verdict, why = checked(chosen, demands_of(asked))
        name = chosen.grasp.id
        entry = plain(entry_of(chosen.grasp, verdict, chosen.body.radius)) or {}
        for key, value in entry.items():
            record_property(f"{name}.{key}", value)
        _note(
            request.node, name, "unstable" if why else "stable", why, (None, entry), chosen.source
        )
        if why:
            raise UnstableError(why)
        return verdict

    return check


def _note(
    item: pytest.Item, grasp: str, status: str, why: str, entries: "Entries" = (None, None),
    source: "Source | None" = None,
) -> None:  # fmt: skip
    """Remember what became of a grasp in a test, with its entries before and after."""
    line: dict[str, Any] = {
        "test": item.nodeid, "grasp": grasp, "status": status, "why": why,
        "before": entries[0], "after": entries[1], "mesh_file": None, "mesh_note": "",
    }  # fmt: skip
    if source is not None:
        line["mesh_file"] = None if source.file is None else str(source.file)
        line["mesh_note"] = source.note
    item.stash.setdefault(LINES, []).append(line)
