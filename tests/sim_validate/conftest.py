"""What rooms share: plans that are made once, and datasets that are built in this process."""

import pytest

from sim_validate.kit.exit_codes import Exit
from sim_validate.main import main
from tests.sim_validate.datasets.engines import here


@pytest.fixture
def built_here(monkeypatch):
    """Let `dataset build` and `dataset import` compute their units in this process."""
    monkeypatch.setattr("sim_validate.datasets.command.local_processes", here)


def planned(folder, *words):
    """The grasps.json of a plan, only to be read."""
    assert main(["plan", *words, "--out", str(folder), "-q"]) == Exit.GOOD
    return folder / "grasps.json"


@pytest.fixture(scope="session")
def wedge_plan(tmp_path_factory):
    """Two grasps of the wedge."""
    return planned(tmp_path_factory.mktemp("wedge"), "wedge", "--limit", "2")


@pytest.fixture(scope="session")
def bracket_plan(tmp_path_factory):
    """Three grasps of an object that fits the hands as it is."""
    return planned(tmp_path_factory.mktemp("bracket"), "l-bracket", "--limit", "3")
