"""Files that are no files, archives that claim too much, paths that lead elsewhere."""

import io
import json
import os
import struct
import zipfile

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.files.file_kinds import BESIDE, GRASPS
from grasp_core.files.json_text import object_of
from grasp_core.files.text_files import read_bytes, read_text
from sim_validate.commands.exit_codes import Exit
from sim_validate.files import array_files
from sim_validate.files.array_files import arrays_of
from sim_validate.files.named_paths import path_inside, require_inside
from sim_validate.files.toml_files import MOST_LETTERS, read_tables, tables_of_toml
from sim_validate.main import main


def test_only_regular_files_are_read_and_no_more_of_them_than_the_limit(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    for path, words in (
        (tmp_path / "pipe", "a folder, a pipe or a device"),
        ("/dev/zero", "a folder, a pipe or a device"),
        (tmp_path, "a folder, a pipe or a device"),
        (tmp_path / "loop", "cannot be read"),
        (tmp_path / ("x" * 300), "cannot be read"),
        (f"{tmp_path}/a\0b", "not a valid file name"),
    ):
        with pytest.raises(gc.InputError, match=words):
            read_text(type(tmp_path)(path))
    (tmp_path / "a").write_bytes(b"12345")
    assert read_bytes(tmp_path / "a", 5) == b"12345"
    with pytest.raises(gc.InputError, match="larger than 4 bytes"):
        read_bytes(tmp_path / "a", 4)


@pytest.mark.parametrize(
    "text",
    ['"' + '\\"' * 400_000 + "\\", '"""' + '\\"' * 400_000 + "\\", "a." * 400_000, "a" * 900_000],
    ids=["escapes", "long text", "a long key", "a long word"],
)
@pytest.mark.timeout(20)
def test_settings_that_never_end_are_refused_at_once(text):
    with pytest.raises(gc.InputError, match=r"not TOML|of the TOML file"):
        tables_of_toml(text)


def test_a_configuration_of_flags_is_a_file_of_values(tmp_path, capsys):
    path = tmp_path / "c.toml"
    for text, words in (
        ("a = 1\na = 2", "not TOML: "),
        ("limit = [{a = 1}]", "limit: expected a value or a list"),
        ("limit = " + "9" * 5000, "not TOML: "),
        ("friction = " + "[" * 5000, "too deep"),
    ):
        path.write_text(text)
        assert main(["plan", "wedge", "--config", str(path)]) == Exit.INPUT
        assert words.format(path) in capsys.readouterr().err
    assert main(["plan", "wedge", "--config", str(tmp_path / "no.toml")]) == Exit.INPUT
    assert main(["plan", "wedge", "--config"]) == Exit.USAGE


def test_long_settings_are_refused_before_they_are_read(tmp_path):
    path = tmp_path / "c.toml"
    path.write_text("a." * (MOST_LETTERS // 2) + "a = 1")
    with pytest.raises(gc.InputError, match="larger than"):
        read_tables(path)
    for key in ("a.", '"a b" . ', "'=,'."):  # tomllib would take hours
        with pytest.raises(gc.InputError, match="has more than 64 parts"):
            tables_of_toml("x = 1\n" + key * (MOST_LETTERS // 8) + "a = 1")
    assert tables_of_toml("a = '" + "1.2." * 5 + "'\nb.c.d = 1.5")["b"] == {"c": {"d": 1.5}}


JSON = {
    '{"a": 1, "a": 2}': "a: the key occurs twice",
    '{"a": %s}' % ("9" * 5000): "thousands of digits",
    '{"a": "\\ud800"}': "the text holds half a character",
    '{"\\ud800": 1}': "the text holds half a character",
    '{"a": "\0"}': "not complete JSON",
    "[" * 100_000: "are nested too deeply",
    '{"a": 1': "not complete JSON .*line 1, column 8",
    "\ufeff{}": "not complete JSON",
    "3": "a thing must hold one JSON object, got 3",
}  # fmt: skip


@pytest.mark.parametrize("text", JSON)
def test_what_json_leaves_open_is_refused(text):
    with pytest.raises(gc.InputError, match=JSON[text]) as raised:
        object_of(text, "thing")
    assert len(str(raised.value)) < 300


def _archive(*members, flag=0):
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members:
            archive.writestr(zipfile.ZipInfo(name), data, zipfile.ZIP_DEFLATED)
    data = bytearray(held.getvalue())
    for mark, place in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        at = data.find(mark)
        data[at + place] |= flag
    return bytes(data)


def _npy(header, body=b"", version=b"\x01\x00"):
    text = header.encode().ljust(118) + b"\n"
    return b"\x93NUMPY" + version + struct.pack("<H", len(text)) + text + body


def _header(descr="'<f8'", shape="(1,)"):
    return f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}}}"


GOOD = _npy(_header(), b"\0" * 8)
ARCHIVES = {
    "encrypted": (_archive(("a.npy", GOOD), flag=1), "cannot be read as npz"),
    "twice": ("twice", "the same name"),
    "object": (_archive(("a.npy", _npy(_header("'|O'"), b"\0" * 8))), "cannot be read as npz"),
    "claim": (_archive(("a.npy", _npy(_header(shape="(1099511627776,)")))), "cannot be read"),
    "no archive": (b"PK nothing", "expected an npz file"),
    "structured": (_archive(("a.npy", _npy(_header("[('x', '<f8')]"), b"\0" * 8))), "expected an"),
    "short": (_archive(("a.npy", _npy(_header(shape="(2,)"), b"\0" * 8))), "cannot be read"),
    "long": (_archive(("a.npy", GOOD + b"\0")), "with nothing behind them"),
    "many": (_archive(*((f"{i}.npy", GOOD) for i in range(300))), "300 members"),
}  # fmt: skip


@pytest.mark.parametrize("case", ARCHIVES)
@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_archives_that_lie_are_refused(case):
    data, words = ARCHIVES[case]
    if case == "twice":
        data = _archive(("a.npy", GOOD), ("a.npy", GOOD))
    with pytest.raises(gc.InputError, match=words):
        arrays_of(data, ["a"])


def test_a_bomb_is_refused_by_what_it_claims_before_it_is_inflated(monkeypatch):
    monkeypatch.setattr(array_files, "MOST_BYTES", 2**22)
    bomb = _archive(*((f"{i}.npy", b"\0" * 2**20) for i in range(5)))
    assert len(bomb) < 2**14
    with pytest.raises(gc.InputError, match="the arrays of the npz file take"):
        arrays_of(bomb, ["a"])
    claims = bytearray(_archive(("a.npy", GOOD)))
    at = claims.find(b"PK\x01\x02")
    claims[at + 24 : at + 28] = struct.pack("<I", 2**32 - 2)
    with pytest.raises(gc.InputError, match="over the limit"):
        arrays_of(bytes(claims), ["a"])


def test_plain_arrays_come_back_as_numpy_writes_them():
    held = io.BytesIO()
    arrays = {
        "a": np.arange(6.0).reshape(2, 3, order="F"), "c": np.array(3, dtype=">i2"),
        "d": np.zeros((0, 3)), "e": np.array([True]),
    }  # fmt: skip
    np.savez_compressed(held, **arrays)
    found = arrays_of(held.getvalue(), [*arrays, "none"])
    assert found.keys() == arrays.keys()
    for name, array in arrays.items():
        np.testing.assert_array_equal(found[name], array)


ELSEWHERE = [
    "/etc/passwd", "../a", "a/../../b", "", "a\0b", "x" * 501, "a\nb", "C:\\a", 3, None, ".",
]  # fmt: skip


@pytest.mark.parametrize("name", ELSEWHERE)
def test_paths_in_files_stay_inside(name):
    with pytest.raises(gc.InputError, match="files: expected"):
        require_inside(name, "files")


def test_links_that_lead_out_are_not_followed(tmp_path):
    (tmp_path / "secret").write_text("x")
    folder = tmp_path / "in"
    folder.mkdir()
    (folder / "link").symlink_to(tmp_path / "secret")
    (folder / "own").symlink_to(folder / "file")
    with pytest.raises(gc.InputError, match="leads out of"):
        path_inside(folder, "link")
    assert path_inside(folder, "own") == folder / "own"


KINDS = {
    "verdicts.json": {"schema": 2, "verdicts": []},
    "regions.json": {"schema": 3, "edge_clearance_m": 0, "reserve": 0, "grasps": []},
    "executions.json": {"schema": 1, "executions": []},
    "reaches.json": {"schema": 2, "hand": {}, "reaches": []},
    "judgements.json": {"schema": 2, "protocols": {}, "judgements": []},
    "baseline": {"schema": 1, "grasps_file": "a"},
    "manifest.json": {"schema": 1, "units_sha256": "", "files": []},
    "wrench file": {"wrenches": []},
}  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_another_file_of_ours_is_called_by_its_name(tmp_path, capsys, kind):
    path = tmp_path / "x.json"
    path.write_text(json.dumps(KINDS[kind]))
    article = "an" if kind.startswith("e") else "a"
    for command, wanted in (("view", GRASPS), ("validate", GRASPS), ("replay", "verdicts.json")):
        if kind == wanted:
            continue
        assert main([command, str(path)]) == Exit.INPUT
        said = capsys.readouterr().err
        assert f"x.json: this is {article} {kind}, not a {wanted}; give the {wanted}" in said
        assert ("beside it" in said) == (wanted == GRASPS and kind in BESIDE)
