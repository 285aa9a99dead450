"""Files of every kind fit their schema, and damaged ones do not."""

import json
import tomllib

import pytest
from jsonschema import Draft202012Validator

import grasp_core as gc
import scenes
from grasp_core.errors import InputError
from grasp_core.figures import meanings
from grasp_core.files import file_kinds
from grasp_core.records.grasps_json import ContactSet
from sim_validate.baselines.suite import suite_from_tables
from sim_validate.commands.console import Reporter
from sim_validate.datasets.config import DatasetConfig, config_from_toml, config_to_toml
from sim_validate.main import main
from sim_validate.schemas.command import show_schema
from sim_validate.schemas.file_schemas import DRAFT, KINDS, address, named, schema_of
from sim_validate.schemas.flags import Schema
from tests.damaged import damaged
from tests.fuzzing.data_files import TARGETS
from tests.schemas import faults_of, faults_of_file

CALLED = {"given": "contacts", "staged": "unit", "dataset-config": "dataset"}
"""Kinds whose targets have other names."""
SCHEMED = [each for each in TARGETS if CALLED.get(each.name, each.name) in KINDS]
BY_NAME = {"summary", "rows", "versions", "verified", "undecided", "bands"}
"""Tables with keys of their own."""


def documents(target):
    """The plain values of the files with which a target begins."""
    for seed in target.seeds():
        text = seed.decode()
        if target.written == "toml":
            yield tomllib.loads(text)
        else:
            yield from map(json.loads, text.splitlines() if target.name == "quarantine" else [text])


def objects_of(schema):
    """Every object that a schema describes."""
    return [each for each in (schema, *schema.get("$defs", {}).values()) if "properties" in each]


def required_of(name):
    """Keys that every object with them must have."""
    parts = objects_of(schema_of(name))
    keys = {key for part in parts for key in part["properties"]}
    lacking = {key for part in parts for key in part["properties"]
               if key not in part.get("required", ())}  # fmt: skip
    return keys - lacking


def check_damaged(name, document, count=150):
    """Unknown keys, wrong types and missing keys are refused by the schema of a kind."""
    wanted, tried = required_of(name), 0
    for what, place, changed in damaged(document, count):
        inside = [key for key in place if isinstance(key, str)][-2:-1]
        refused = {"missing": place[-1] in wanted, "wrong type": True, "unknown key": True}
        if refused.get(what) and not BY_NAME & {*inside}:
            tried += 1
            assert faults_of(name, changed), (what, place)
    assert tried


@pytest.mark.parametrize("name", KINDS)
def test_every_kind_of_files_has_a_schema_with_meanings(name):
    schema = schema_of(name)
    Draft202012Validator.check_schema(schema)
    assert (schema["$schema"], schema["$id"]) == (DRAFT, address(name))
    assert schema["title"]
    assert schema["description"]
    assert all(part["additionalProperties"] is False for part in objects_of(schema))
    json.dumps(schema, allow_nan=False)


def test_every_kind_that_is_told_apart_has_a_schema():
    called = {each.called for each in KINDS.values()}
    assert {*file_kinds.WRITTEN, *file_kinds.GIVEN.values()} <= called


@pytest.mark.parametrize("target", SCHEMED, ids=lambda each: each.name)
def test_files_fit_their_schema_and_damaged_ones_do_not(target):
    name = CALLED.get(target.name, target.name)
    for document in documents(target):
        assert faults_of(name, document) == []
        check_damaged(name, document)


@pytest.mark.parametrize(
    ("words", "file"),
    [
        (["plan", "tetrahedron", "--best", "--gap", "0.5"], "best.json"),
        (["validate", "GRASPS", "--limit", "1", "--protocol", "dexgraspbench"], "judgements.json"),
        (["transfer", "GRASPS", "octahedron"], "transfer.json"),
    ],
    ids=["best", "judgements", "transfer"],
)
def test_what_a_command_wrote_fits(words, file, tmp_path):
    grasps = tmp_path / "grasps.json"
    gc.save_grasps(grasps, gc.plan(scenes.example_object("tetrahedron"), limit=1))
    given = [str(grasps) if word == "GRASPS" else word for word in words]
    main([*given, "--out", str(tmp_path / "out"), "-q"])
    assert faults_of_file(tmp_path / "out" / file) == []
    check_damaged(named(file), json.loads((tmp_path / "out" / file).read_text()))


def test_keys_have_the_meanings_and_units_of_their_fields():
    analyses = schema_of("analyses")
    assert analyses["properties"]["schema"]["const"] == 1
    assert "schema" in analyses["required"]
    own = analyses["$defs"]["Analysis"]["properties"]
    center = meanings(ContactSet)["center"]
    assert (own["center_m"]["unit"], own["center_m"]["description"]) == ("m", center)
    assert own["critical_friction"]["anyOf"][1] == {"type": "null"}
    given = schema_of("wrenches")["$defs"]["GivenWrench"]["properties"]
    assert given["torque_n_m"]["unit"] == "N m"


@pytest.mark.parametrize("name", ["contacts", "wrenches", "dataset", "suite"])
def test_every_key_of_a_file_that_people_write_has_a_meaning(name):
    parts = objects_of(schema_of(name))
    own = [part for part in parts if part is parts[0] or "Given" in part["title"]]
    assert [key for part in own for key, each in part["properties"].items()
            if "description" not in each] == []  # fmt: skip


def test_what_the_reader_of_a_file_adds_need_not_be_in_it(tmp_path):
    given = {"grasps": "grasps.json", "repeats": 20}
    assert faults_of("suite", given) == []
    suite = suite_from_tables(given, tmp_path / "wedge.grasps.toml")
    assert suite.baseline == tmp_path / "wedge.baseline.json"
    assert faults_of("suite", {"repeats": 20})


def test_settings_that_only_the_program_chooses_stand_in_results_alone():
    chosen = {"drive", "indentation"}
    assert not chosen & schema_of("setup")["$defs"]["FingerSettings"]["properties"].keys()
    assert chosen < schema_of("verdicts")["$defs"]["FingerSettings"]["properties"].keys()
    assert "threads" not in schema_of("setup")["properties"]


def test_keys_of_flat_parts_stand_among_the_others():
    executed = schema_of("executions")["$defs"]["ExecutedGrasp"]
    assert {"mass_kg", "squeeze_n"} <= executed["properties"].keys()
    assert "execution" not in executed["properties"]
    assert "mass_kg" not in executed["required"]  # absent where there is no execution
    assert "max_normal_force_n" in schema_of("analyses")["required"]


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("verdicts", "verdicts"), ("verdicts.json", "verdicts"), ("contacts file", "contacts"),
        ("Baseline", "baseline"), ("document of analyses", "analyses"), ("setup", "setup"),
        ("setup.toml", "setup"),
    ],
)  # fmt: skip
def test_kinds_are_found_by_their_names(text, name, capsys):
    assert named(text) == name
    assert show_schema(Schema(text), Reporter()) == 0
    assert json.loads(capsys.readouterr().out) == schema_of(name)


@pytest.mark.parametrize(
    ("text", "hint"), [("verdict.json", r"mean verdicts\?"), ("x", "choose from grasps, best")]
)
def test_an_unknown_kind_is_refused_with_names_like_it(text, hint):
    with pytest.raises(InputError, match=hint):
        show_schema(Schema(text), Reporter())


def test_all_kinds_are_listed(capsys):
    assert show_schema(Schema(), Reporter(json_only=True)) == 0
    assert json.loads(capsys.readouterr().out).keys() == KINDS.keys()
    assert show_schema(Schema(), Reporter()) == 0
    said = capsys.readouterr().out
    assert all(name in said for name in KINDS)


def test_a_configuration_names_its_schema_which_changes_no_hash(tmp_path):
    config = DatasetConfig(objects=("wedge",))
    path = tmp_path / "config.toml"
    path.write_text(config_to_toml(config))
    assert path.read_text().startswith(f"#:schema {address('dataset')}\n")
    assert faults_of_file(path) == []
    path.write_text(path.read_text().replace("example.org", "example.com"))
    assert config_from_toml(path).sha256 == config.sha256
