"""Evidence of known cases is kept on disk, and counts only where it is ours, whole and passed."""

import json
from dataclasses import dataclass, replace

import pytest

from grasp_core.errors import UnfaithfulError
from scenes.settings import FingerSettings
from sim_validate.engine import kept_gates
from sim_validate.engine.closure_cases import ClosureCase
from sim_validate.engine.known_cases import GateCheck
from sim_validate.engine.setup import Setup

measurements = []


@dataclass(frozen=True)
class Counted:
    """A case that counts how often it is measured."""

    name: str
    value: float = 0.25

    def checks(self):
        measurements.append(self.name)
        return (GateCheck("a figure", self.value, 0.0, 1.0),)


@pytest.fixture(autouse=True)
def own_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    measurements.clear()
    return tmp_path / "graspproof" / "gates"


def in_a_new_process(case):
    """Check a case as a process does that has measured nothing yet."""
    kept_gates._kept_or_measured.cache_clear()
    kept_gates.measured.cache_clear()
    return kept_gates.checked(case)


def test_a_second_process_measures_nothing(own_folder):
    first = in_a_new_process(Counted("twice"))
    (path,) = own_folder.iterdir()
    assert json.loads(path.read_text())["measured"]["mujoco"]
    assert in_a_new_process(Counted("twice")) == first
    assert measurements == ["twice"]


@pytest.mark.parametrize(
    "spoil",
    [
        lambda text: text[:-9],
        lambda _: "[]",
        lambda text: text.replace('"value": 0.25', '"value": 7.5'),
        lambda text: text.replace('"value": 0.25', '"value": "little"'),
        lambda text: text.replace("Counted(name='spoiled'", "Counted(name='other'"),
        lambda text: text.replace('"arithmetic": "', '"arithmetic": "0'),
    ],
)
def test_what_is_damaged_or_states_something_else_is_measured_anew(own_folder, spoil):
    case = Counted("spoiled")
    first = in_a_new_process(case)
    (path,) = own_folder.iterdir()
    before = path.read_text()
    path.write_text(spoil(before))
    assert path.read_text() != before
    assert in_a_new_process(case) == first
    assert measurements == ["spoiled"] * 2


@pytest.mark.parametrize("changed", [{"versions": dict}, {"_text_hash": lambda: "another"}])
def test_other_versions_or_another_text_measure_anew(monkeypatch, changed):
    in_a_new_process(Counted("changed"))
    for name, value in changed.items():
        monkeypatch.setattr(kept_gates, name, value)
    in_a_new_process(Counted("changed"))
    assert measurements == ["changed"] * 2


def test_a_failed_gate_is_measured_in_each_process():
    for _ in range(2):
        with pytest.raises(UnfaithfulError, match="a figure"):
            in_a_new_process(Counted("failed", 2.0))
    assert measurements == ["failed"] * 2


def test_without_a_folder_to_write_to_gates_are_measured(monkeypatch, tmp_path):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    for _ in range(2):
        assert in_a_new_process(Counted("nowhere")).passed
    assert measurements == ["nowhere"] * 2


def test_settings_that_differ_in_the_last_digit_have_gates_of_their_own():
    setups = [
        Setup(fingers=FingerSettings(max_normal_force_n=push))
        for push in (10.0, 10.000000000000002)
    ]
    cases = [ClosureCase.of(setup) for setup in setups]
    assert repr(cases[0]) != repr(cases[1])
    assert repr(cases[0]) != repr(replace(cases[0], friction=0.5000000000000001))
