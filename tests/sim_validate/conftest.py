"""What rooms share: plans that are made once, and commands that are run here or only read."""

import json
from itertools import count

import pytest

from grasp_core.time_spent import TIME_SPENT, in_words
from sim_validate.commands.exit_codes import Exit
from sim_validate.main import main
from tests.sim_validate.datasets import engines


@pytest.fixture
def built_here(monkeypatch):
    """Let `dataset build` and `dataset import` compute their units in this process."""
    monkeypatch.setattr("sim_validate.datasets.clusters.local_processes", engines.here)


@pytest.fixture
def here(tmp_path, monkeypatch):
    """The working folder, in which nothing is."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def answer(capsys):
    """The document that a command prints with --json."""

    def answered(*words, code=Exit.GOOD):
        assert main([*map(str, words), "--json"]) == code
        return json.loads(capsys.readouterr().out)

    return answered


@pytest.fixture
def asked(monkeypatch):
    """The commands that were read from command lines, of which none is run."""
    found = []
    monkeypatch.setattr(
        "sim_validate.main._dispatch", lambda _, each: found.append(each) or Exit.GOOD
    )
    return found


@pytest.fixture
def spent(monkeypatch):
    """The seconds of each kind of work that a command tells, by a clock that each look moves on."""
    found = {}
    monkeypatch.setattr(TIME_SPENT, "_counted", 0.0)
    monkeypatch.setattr(TIME_SPENT, "_clock", count(1.0).__next__)
    monkeypatch.setattr(
        "sim_validate.main.in_words", lambda each: found.update(each) or in_words(each)
    )
    return found


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
