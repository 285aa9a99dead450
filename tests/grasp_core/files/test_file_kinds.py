"""A file of ours that is given in place of another is refused by its name."""

import json
from itertools import product

import pytest

import grasp_core as gc
from grasp_core.files import file_kinds
from grasp_core.files.file_kinds import BESIDE, CONTACTS_FILE, GIVEN, GRASPS, WRITTEN, kind_of
from grasp_core.files.json_text import object_of
from grasp_core.files.records import RecordFile, keys
from grasp_core.planning.grasps_json import ContactsFile, contact_sets_from_json
from grasp_core.planning.result import Plan
from sim_validate.baselines.baseline import Baseline
from sim_validate.closure.verdict import Verdicts
from sim_validate.datasets.manifest import Manifest
from sim_validate.datasets.resuming import UnitRecord
from sim_validate.engine.setup import WrenchFile
from sim_validate.execution.verdict import Executions
from sim_validate.hands.reaches import Reaches
from sim_validate.planning.analyze import Analyses
from sim_validate.planning.best import Best
from sim_validate.planning.regions import Regions
from sim_validate.planning.transfer import TransferFile
from sim_validate.protocols.verdict import Judgements

RECORDS = (Baseline, Verdicts, Regions, Executions, Reaches, Judgements, TransferFile, Manifest,
           UnitRecord, Best, Analyses)  # fmt: skip
FIELDS = {each.FILE: ("schema", *keys(each)) for each in RECORDS} | {
    GRASPS: ("schema", "object", *keys(Plan)), file_kinds.WRENCH_FILE: keys(WrenchFile),
    CONTACTS_FILE: tuple({*keys(ContactsFile)} - {"grasps"}),
    "contacts of several grasps": tuple({*keys(ContactsFile)} - {"contacts"}),
}  # fmt: skip
"""The keys of a file of each kind."""
CALLED = {"contacts of several grasps": CONTACTS_FILE}


def of_package(kind):
    return {each for own in kind.__subclasses__() for each in (own, *of_package(own))
            if each.__module__.startswith(("grasp_core", "scenes", "sim_validate"))}  # fmt: skip


def test_every_kind_of_file_stands_in_the_list_and_is_known_by_a_key_of_its_own():
    assert {each.FILE for each in of_package(RecordFile) if hasattr(each, "FILE")} <= {*WRITTEN}
    assert {CALLED.get(kind, kind) for kind in FIELDS} == {*WRITTEN, *GIVEN.values()}
    for kind, own in FIELDS.items():
        assert [name for name, key in WRITTEN.items() if key in own] == [kind][: kind in WRITTEN]
        assert kind_of(dict.fromkeys(own)) == CALLED.get(kind, kind)


@pytest.mark.parametrize("wanted", [*WRITTEN, *GIVEN.values()])
def test_a_file_of_another_kind_is_called_by_its_name(wanted):
    for given, own in FIELDS.items():
        text, kind = json.dumps(dict.fromkeys(own, 1)), CALLED.get(given, given)
        if kind == wanted:
            assert object_of(text, wanted)
            continue
        with pytest.raises(gc.InputError) as refused:
            object_of(text, wanted)
        said, articles = str(refused.value), {"executions.json": "an"}
        assert said.startswith(f"this is {articles.get(kind, 'a')} {kind}, not a")
        assert f"; give the {wanted}" in said
        assert said.endswith(" beside it") == (wanted == GRASPS and kind in BESIDE)


def test_a_damaged_file_is_not_taken_for_another_kind():
    for kind, missing in product(FIELDS, range(max(map(len, FIELDS.values())))):
        own = [*FIELDS[kind][:missing], *FIELDS[kind][missing + 1 :]]
        if kind in WRITTEN:
            assert kind_of(dict.fromkeys(own)) in (kind, None)


def test_a_plan_among_contacts_and_other_results_are_told_apart():
    with pytest.raises(gc.InputError, match=r"this is a reaches\.json, not a grasps\.json"):
        contact_sets_from_json(json.dumps(dict.fromkeys(FIELDS["reaches.json"], 1)))
