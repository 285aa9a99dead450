"""A dataset with executions: its grasps, its natural negatives, and what is wrong with forged rows.

One kilogram is too much for the grasp of the wedge, though it is in force closure, and not for that
of the tetrahedron.
"""

import shutil
from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
import sim_validate as sv
from scenes.example_objects import example_object
from sim_validate.datasets.build import build
from sim_validate.datasets.columns import GraspRow
from sim_validate.datasets.config import DatasetConfig
from sim_validate.datasets.learning import execution_cells, execution_rows
from sim_validate.datasets.open_dataset import select
from sim_validate.datasets.recomputing import verdict_differences
from sim_validate.datasets.verify import verify
from sim_validate.execution.verdict import CLEAR_OF_SLIP, ExecutedGrasp
from tests.sim_validate.datasets.configs import rows_of
from tests.sim_validate.datasets.engines import Here, silent
from tests.sim_validate.datasets.forging import first, forged

pytest.importorskip("pyarrow")
SETTINGS = sv.ExecutionSettings(mass_kg=1.2, trials=("weight",))
CONFIG = DatasetConfig(
    objects=("tetrahedron", "wedge"), families=("concurrent",), limit=1,
    execution=SETTINGS,
)  # fmt: skip


@pytest.fixture(scope="module")
def executed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("executed") / "ds"
    built = build(CONFIG, folder, Here(), silent)
    assert (built.manifest.quarantined, built.manifest.rows["executions"]) == (0, 2)
    return folder


@pytest.fixture
def copied(executed, tmp_path):
    return shutil.copytree(executed, tmp_path / "copy")


def grasps_of(folder):
    """Rows of planned grasps by the name of their object."""
    names = {row["object_id"]: row["source_name"] for row in rows_of(folder, "objects")}
    rows = [row for row in rows_of(folder, "grasps") if row["control_of"] is None]
    return {names[row["object_id"]]: row for row in rows}


def test_a_grasp_that_loses_its_object_is_a_natural_negative(executed):
    rows = grasps_of(executed)
    kept, lost = rows["tetrahedron"], rows["wedge"]
    assert all(row["executed"] and row["force_closed"] and row["held"] for row in (kept, lost))
    assert kept["survived"]
    assert kept["predicted_first_slip"] > 1.0
    assert not lost["survived"]
    assert lost["predicted_first_slip"] < 1.0
    assert lost["load_multiple"] < 1.0
    controls = [row for row in rows_of(executed, "grasps") if row["control_of"] is not None]
    assert controls
    assert all(row["executed"] is False and row["survived"] is None for row in controls)


def test_the_rows_say_what_an_execution_says(executed):
    wedge = example_object("wedge")
    row = grasps_of(executed)["wedge"]
    (grasp,) = gc.plan(wedge, 0.5, families=("concurrent",), limit=1).grasps
    found = sv.execute(wedge, grasp, 0.5, SETTINGS)
    assert row["mass_kg"] == found.mass_kg
    assert row["load_multiple"] == found.load_multiple
    assert np.array_equal(row["squeeze_n"], found.squeeze)
    assert row["execution_mismatches"] == sum(not each.let_go for each in found.controls)
    (trial,) = found.trials
    (stored,) = [
        each for each in rows_of(executed, "executions") if each["grasp_id"] == row["grasp_id"]
    ]
    for name in ("kind", "name", "survived", "fate", "slip_m", "displacement_m", "turn_rad",
                 "predicted_first_slip", "simulated_first_slip"):  # fmt: skip
        assert stored[name] == getattr(trial, name), name


def executed_row(row):
    return row.get("executed", True)


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("grasps", first(executed_row, load_multiple=2.0), "is not proved to carry as much"),
        ("grasps", first(executed_row, mass_kg=0.5), "is 0.5, but 1.2 by config.toml"),
        ("grasps", first(executed_row, squeeze_n=[[1.0] * 3] * 4), "the squeeze must balance"),
        ("grasps", first(executed_row, executed_trials=2), "executed_trials is 2, but 1 by"),
        ("grasps", first(executed_row, executed=False), "although none was simulated"),
        ("grasps", first(lambda row: not row["executed"], survived=True), "none was simulated"),
        ("executions", first(executed_row, predicted_first_slip=9.0), "but 9.0 by the table of"),
        ("executions", first(executed_row, survived=None), "survived"),
        ("executions", first(executed_row, grasp_id="0" * 20), "has no row in the table of grasps"),
        ("executions", lambda rows: rows.clear(), "executed_trials is 1, but 0 by"),
    ],
)  # fmt: skip
def test_forged_rows_are_named(copied, name, change, message):
    forged(copied, name, change)
    assert any(message in fault for fault in verify(copied))


def test_trials_that_come_out_otherwise_are_named(copied):
    forged(
        copied, "executions", lambda rows: [row.update(slip_m=row["slip_m"] + 1e-6) for row in rows]
    )
    assert verify(copied) == []
    faults = verify(copied, 0.01)
    assert len(faults) == 1
    assert "slip_m is" in faults[0]


def test_survival_may_differ_by_rounding_only_where_contacts_slip(executed):
    survived = next(row for row in select(executed).rows(GraspRow) if row.survived)
    kept = replace(survived, predicted_first_slip=2.0 * CLEAR_OF_SLIP)
    (said,) = verdict_differences(kept, replace(kept, survived=False))
    assert "survived is True, but False by computing it again" in said
    slipping = replace(kept, predicted_first_slip=1.0)
    assert list(verdict_differences(slipping, replace(slipping, survived=False))) == []


def test_a_grasp_without_a_squeeze_did_not_survive_and_a_refused_one_is_not_known():
    unheld = ExecutedGrasp("c", "concurrent", "0", None, "no squeeze holds")
    assert execution_cells(unheld) == {
        "executed": False, "survived": False, "execution_note": "no squeeze holds"
    }  # fmt: skip
    assert "survived" not in execution_cells("the tips overlap")
    assert execution_cells(None) == {}
    assert list(execution_rows("a", unheld, CONFIG)) == []
