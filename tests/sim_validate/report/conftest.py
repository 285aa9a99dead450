"""A small run, and what its report is."""

import pytest

from sim_validate.commands.exit_codes import Exit
from sim_validate.main import main
from sim_validate.report import report as reports
from sim_validate.report.cards import Drawn
from sim_validate.report.report import write_report


@pytest.fixture(scope="session")
def small_run(tmp_path_factory):
    """The folder of a run of three grasps with certified regions and simulated limits."""
    folder = tmp_path_factory.mktemp("run")
    asked = ["run", "wedge", "--limit", "3", "--families", "pencil,concurrent"]
    asked += ["--limits", "ramp", "--repeats", "2", "--no-report", "-q"]
    assert main([*asked, "--out", str(folder)]) == Exit.GOOD
    certify = ["regions", str(folder / "grasps.json"), "--max-cones", "64", "-q"]
    assert main([*certify, "--out", str(folder)]) == Exit.GOOD
    return folder


@pytest.fixture(scope="session")
def small_report(small_run, tmp_path_factory):
    return write_report(small_run, tmp_path_factory.mktemp("report"), jobs=1).index.parent


@pytest.fixture
def no_pictures(monkeypatch):
    """Pages without their pictures, which take a second."""
    monkeypatch.setattr(reports, "draw", lambda _, card: Drawn(f"pictures/{card.name}"))
