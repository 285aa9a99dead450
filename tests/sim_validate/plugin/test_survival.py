"""Tests of somebody else's that demand that objects survive their execution."""

import json
import re

import pytest

import sim_validate as sv
from grasp_core.files.text_files import write_text
from grasp_core.planning.grasps_json import load_grasps
from tests.sim_validate.plugin.project import properties_in, run_pytest
from tests.sim_validate.rigs import saved_plan

CODE = """
import pytest
import sim_validate as sv

pytestmark = pytest.mark.grasp("grasps.json")

def test_light(grasp_case, assert_survives):
    settings = sv.ExecutionSettings(mass_kg=0.1, trials=("weight",))
    assert assert_survives(grasp_case, settings).survived

def test_heavy(grasp_case, assert_survives):
    settings = sv.ExecutionSettings(mass_kg=1.2, trials=("weight",))
    assert_survives(grasp_case.body, grasp_case.grasp, grasp_case.friction, settings)
"""
SUITE = """
grasps = "grasps.json"
survives = true

[execution]
mass_kg = {mass_kg}
trials = ["weight"]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("survival")
    saved_plan(folder)
    return folder


@pytest.fixture(scope="module")
def found(folder):
    """What comes out where the wedge weighs one kilogram."""
    saved = load_grasps(folder / "grasps.json")
    settings = sv.ExecutionSettings(mass_kg=1.2, trials=("weight",))
    return sv.execute(saved.body, saved.grasps[0], saved.friction, settings)


def predicted(found):
    return f"first slip predicted at {found.trials[0].predicted_first_slip:.3g} of the load"


def test_an_assertion_names_the_trial_the_numbers_and_the_prediction(folder, found, tmp_path):
    write_text(folder / "test_it.py", CODE)
    code, said = run_pytest(folder, "test_it.py", "--junitxml", str(tmp_path / "j.xml"))
    assert code == 1, said
    assert "1 failed, 1 passed" in said
    assert "with 1.2 kg: 1 of 1 trials lost; its squeeze is certified for" in said
    assert f"{found.load_multiple:.4g} times the weight" in said
    assert "weight: moved or turned too far after a slip, moved " in said
    assert predicted(found) in said
    kept = properties_in(tmp_path / "j.xml")
    ended = [value for each in kept for name, value in each.items() if name.endswith(".status")]
    assert sorted(ended) == ["lost", "survived"]


def test_a_suite_demands_survival_whatever_its_baseline_says(folder, found):
    suite = folder / "wedge.grasps.toml"
    write_text(suite, SUITE.format(mass_kg=1.2))
    code, said = run_pytest(folder, "--grasp-bless", str(suite))
    assert code == 0, said
    baseline = json.loads((folder / "wedge.baseline.json").read_text())
    assert baseline["settings"]["execution"]["mass_kg"] == 1.2
    assert baseline["grasps"][0]["execution"]["lost"] == ["weight"]
    code, said = run_pytest(folder, str(suite))
    assert code == 1
    assert "the grasp must survive its execution, but does not" in said
    assert re.search(r"execution: lost +1 +1", said)
    assert predicted(found) in said
