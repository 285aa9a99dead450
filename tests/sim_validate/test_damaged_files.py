"""Damaged files of every kind are refused, each with the field that is wrong."""

import json

import pytest

import grasp_core as gc
import scenes
from sim_validate.baselines.baseline import Baseline
from sim_validate.closure.verdict import Verdicts
from sim_validate.datasets.manifest import Manifest
from sim_validate.datasets.resuming import UnitRecord
from sim_validate.execution.verdict import Executions
from sim_validate.hands.reaches import Reaches
from sim_validate.main import main
from sim_validate.planning.best import Best
from sim_validate.planning.regions import Regions
from sim_validate.protocols.verdict import Judgements
from tests.damaged import check_refused, optional_keys
from tests.fuzzing.data_files import TARGETS

KINDS = {
    "verdicts": Verdicts, "executions": Executions, "regions": Regions, "reaches": Reaches,
    "baseline": Baseline, "manifest": Manifest, "staged": UnitRecord,
}  # fmt: skip
LOOSE = ("versions", "files")
"""Tables with keys of their own."""


def check(kind, document):
    check_refused(
        kind.of_text, document, optional=optional_keys(kind), loose=LOOSE, large=None, count=100
    )  # fmt: skip


@pytest.mark.parametrize("name", KINDS)
def test_a_damaged_file_is_refused_with_the_field_named(name):
    (target,) = (each for each in TARGETS if each.name == name)
    check(KINDS[name], json.loads(target.seeds()[0]))


@pytest.mark.parametrize(
    ("command", "kind"),
    [
        (["plan", "tetrahedron", "--best", "--gap", "0.5"], Best),
        (["validate", "GRASPS", "--limit", "1", "--protocol", "dexgraspbench"], Judgements),
    ],
    ids=["best", "judgements"],
)
def test_what_a_command_wrote_is_refused_once_it_is_damaged(command, kind, tmp_path):
    grasps = tmp_path / "grasps.json"
    gc.save_grasps(grasps, gc.plan(scenes.example_object("tetrahedron"), limit=1))
    words = [str(grasps) if word == "GRASPS" else word for word in command]
    main([*words, "--out", str(tmp_path), "-q"])
    check(kind, json.loads((tmp_path / kind.FILE).read_text()))
