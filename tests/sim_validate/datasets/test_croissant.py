import dataclasses
import hashlib
import json
from fnmatch import fnmatch

import pytest

from sim_validate.cli.exit_codes import Exit
from sim_validate.datasets.columns import KEYS, REFERENCES, TABLES
from sim_validate.datasets.describing.croissant import (
    ASKED,
    CROISSANT,
    croissant_text,
    missing_fields,
)
from sim_validate.datasets.manifest import read_manifest
from sim_validate.datasets.parquet import read_rows
from sim_validate.main import main
from tests.sim_validate.datasets.small import SMALL, build_small

pytest.importorskip("pyarrow")
REQUIRED = (
    "@context", "@type", "conformsTo", "name", "description", "license", "url", "creator",
    "datePublished", "distribution",
)  # fmt: skip
"""By the specification of Croissant 1.1; its reader only warns of some."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return build_small(tmp_path_factory.mktemp("croissant") / "ds")


@pytest.fixture(scope="module")
def record(folder):
    return json.loads((folder / CROISSANT).read_text())


def of_type(record, kind):
    return [each for each in record["distribution"] if each["@type"] == kind]


def tables(record):
    return {each["@id"]: each for each in record["recordSet"] if each["@id"] in TABLES}


def test_all_required_fields_are_there(record):
    assert [name for name in REQUIRED if not record.get(name)] == []
    assert record["@type"] == "sc:Dataset"
    assert "http://mlcommons.org/croissant/1.1" in record["conformsTo"]
    assert record["license"] == "https://spdx.org/licenses/CC-BY-4.0"
    assert record["creator"] == {"@type": "sc:Person", "name": "A. Maker"}
    assert (record["url"], record["datePublished"]) == (SMALL.url, SMALL.published)
    assert record["version"].count(".") == 2
    assert record["rai:hasSyntheticData"] is True
    assert all(record[f"rai:{name}"] for name in ("dataCollection", "dataLimitations"))


def test_every_file_is_there_with_its_size_and_hash(folder, record):
    files = of_type(record, "cr:FileObject")
    for each in files:
        data = (folder / each["contentUrl"]).read_bytes()
        assert each["sha256"] == hashlib.sha256(data).hexdigest()
        assert each["contentSize"] == f"{len(data)} B"
        assert each["encodingFormat"]
    listed = {each["@id"] for each in files}
    described = listed | {
        each.path
        for each in read_manifest(folder).files
        if any(fnmatch(each.path, one["includes"]) for one in of_type(record, "cr:FileSet"))
    }
    assert described == {each.path for each in read_manifest(folder).files} - {CROISSANT}
    assert len(listed) == 9 + 3


def test_every_reference_names_something_that_is_there(folder, record):
    sets = {each["@id"]: each for each in of_type(record, "cr:FileSet")}
    fields = {field["@id"] for each in record["recordSet"] for field in each["field"]}
    ids = [each["@id"] for each in (*record["distribution"], *record["recordSet"])]
    assert len({*ids, *fields}) == len(ids) + len(fields)
    links = {}
    for name, table in tables(record).items():
        assert [key["@id"] for key in table["key"]] == [f"{name}/{key}" for key in KEYS[name]]
        rows = read_rows(next(folder.glob(sets[f"{name}-files"]["includes"])))
        for field in table["field"]:
            assert field["source"]["fileSet"]["@id"] == f"{name}-files"
            assert field["source"]["extract"]["column"] in rows[0]
            if "references" in field:
                links[field["@id"]] = field["references"]["field"]["@id"]
    assert set(links.values()) <= fields
    wanted = {"/".join(one): "/".join(other) for one, other in REFERENCES.items()}
    assert links == wanted | {f"{name}/split": "splits/name" for name in ("objects", "grasps")}


def test_every_column_is_described_with_type_shape_and_unit(record):
    count = 0
    for name, table in tables(record).items():
        assert [field["name"] for field in table["field"]] == [each.name for each in TABLES[name]]
        for field, column in zip(table["field"], TABLES[name], strict=True):
            assert column.meaning in field["description"]
            assert field["description"].endswith(f"[{column.unit}]") or not column.unit
            kind = {"text": "Text", "bool": "Boolean", "int": "Integer", "float": "Float"}
            assert field["dataType"] == f"sc:{kind[column.kind]}"
            shape = tuple(map(int, field.get("arrayShape", "").split(",") if column.shape else ()))
            assert shape == column.shape
            assert field.get("isArray", False) is bool(column.shape)
            count += 1
    assert count == sum(map(len, TABLES.values()))


def test_splits_are_those_of_the_rows(folder, record):
    (splits,) = [each for each in record["recordSet"] if each["@id"] == "splits"]
    named = {each["splits/name"] for each in splits["data"]}
    rows = [row for path in folder.glob("data/objects/*.parquet") for row in read_rows(path)]
    assert {row["split"] for row in rows} == named


def test_equal_datasets_are_described_by_equal_bytes(folder):
    manifest = read_manifest(folder)
    turned = dataclasses.replace(manifest, files=manifest.files[::-1])
    text = (folder / CROISSANT).read_text()
    assert croissant_text(SMALL, manifest) == croissant_text(SMALL, turned) == text


@pytest.mark.parametrize("name", ASKED)
def test_what_is_not_given_is_left_out_and_named(folder, name):
    bare = dataclasses.replace(SMALL, **{ASKED[name]: ""})
    record = json.loads(croissant_text(bare, read_manifest(folder)))
    assert missing_fields(bare) == {name: ASKED[name]}
    assert [each for each in REQUIRED if not record.get(each)] == [name]


def test_nothing_is_missing_when_all_is_given():
    assert missing_fields(SMALL) == {}
    assert set(ASKED) < set(REQUIRED)


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ("cc0-1.0", "https://spdx.org/licenses/CC0-1.0"),
        ("odbl", "https://spdx.org/licenses/ODbL-1.0"),
        ("https://example.org/terms", "https://example.org/terms"),
        ("our own", {"@type": "sc:CreativeWork", "name": "our own"}),
    ],
)
def test_licences_are_addresses_where_they_are_known(folder, given, expected):
    config = dataclasses.replace(SMALL, license=given)
    assert json.loads(croissant_text(config, read_manifest(folder)))["license"] == expected


@pytest.mark.parametrize("text", ['"]: x', "a\nb", "<script>", "\udc80", "\U0001f916"])
def test_words_of_the_user_stay_words(folder, text):
    config = dataclasses.replace(SMALL, title=text, creator=text, url=text)
    found = croissant_text(config, read_manifest(folder))
    assert found.isascii()
    record = json.loads(found)
    assert record["name"] == record["creator"]["name"] == record["url"] == text


def test_a_dataset_without_rows_is_described(folder):
    manifest = read_manifest(folder)
    empty = dataclasses.replace(manifest, units=3, quarantined=3, files=())
    record = json.loads(croissant_text(SMALL, empty))
    assert [each["@id"] for each in record["recordSet"]] == ["splits"]


def test_a_build_says_once_which_flags_are_missing(tmp_path, capsys):
    names = ["dataset", "build", "tetrahedron", "--family", "concurrent", "--limit", "1"]
    flags = ["--license", "MIT", "--creator", "A", "--url", "https://a.b", "--published"]
    assert main([*names, "--out", str(tmp_path / "a")]) == Exit.GOOD
    said = capsys.readouterr().err
    assert said.count(CROISSANT) == 1
    assert all(flag in said for flag in flags if flag.startswith("--"))
    assert main([*names, "--out", str(tmp_path / "b"), *flags, "2026-11-22"]) == Exit.GOOD
    assert CROISSANT not in capsys.readouterr().err
    assert main([*names, "--out", str(tmp_path / "c"), *flags, "soon"]) == Exit.INPUT
    assert "2026-11-22" in capsys.readouterr().err


@pytest.mark.filterwarnings("ignore")
def test_the_reference_reader_reads_all_rows(folder, record):
    reader = pytest.importorskip("mlcroissant")
    for name in ("splits", *tables(record)):
        # One reader for each: a second table that refers to the first fails in mlcroissant 1.1.1.
        found = reader.Dataset(str(folder / CROISSANT))
        assert not found.metadata.ctx.issues.errors
        count = read_manifest(folder).rows().get(name, 3)
        assert sum(1 for _ in found.records(name)) == count
