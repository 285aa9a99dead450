"""Files and folders are read in order, each in its own format, and nothing is lost silently."""

import json
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.errors import InputError
from sim_validate.files.numpy_pickles import unpickled
from sim_validate.judge.formats import reading
from sim_validate.judge.formats.reading import FORMATS, read_records
from sim_validate.judge.records import BadRecord, HandRecord
from tests.scenes.drawing.standing import run_with_hand
from tests.sim_validate.judge.recorded import listed, net_tables, qpos, records, seven

MB = 2**20


def save(path, **other):
    path.parent.mkdir(parents=True, exist_ok=True)
    place = seven(np.eye(4))
    table = {"obj_path": "mug", "obj_scale": 0.1, "obj_pose": place, "grasp_qpos": qpos(RNG)[1]}
    np.save(path, table | other)
    return path


RNG = np.random.default_rng(0)


def test_folders_are_read_in_order_without_hidden_files(tmp_path):
    for name in ("b/0.npy", "a/1.npy", "a/0.npy", ".hidden/0.npy", "a/.0.npy"):
        save(tmp_path / name)
    (tmp_path / "README.md").write_text("about")
    (tmp_path / "c.npy").write_bytes(b"")
    (tmp_path / "d.npy").mkdir()
    found = records(tmp_path)
    assert [each.id for each in found] == ["a/0.npy", "a/1.npy", "b/0.npy", "c.npy"]
    assert [type(each) for each in found] == [HandRecord] * 3 + [BadRecord]


def test_ids_differ(tmp_path):
    for name in ("a/x/0.npy", "b/x/0.npy", "b/1.npy"):
        save(tmp_path / name)
    paths = [tmp_path / "a", tmp_path / "b", tmp_path / "b" / "1.npy", tmp_path / "a"]
    found = [each.id for each in read_records(paths)]
    assert found == [
        f"{tmp_path.as_posix()}/{name}" for name in ("a/x/0.npy", "b/1.npy", "b/x/0.npy")
    ]
    assert [each.id for each in read_records(paths[1:3])] == ["1.npy", "x/0.npy"]


def test_a_name_that_cannot_be_printed_is_spelled(tmp_path):
    save(tmp_path / "a\nb.npy")
    assert [each.id for each in records(tmp_path)] == ["'a\\nb.npy'"]


def test_formats_are_told_apart_or_may_be_stated(tmp_path):
    save(tmp_path / "bench.npy")
    np.save(tmp_path / "net.npy", listed(net_tables(RNG, 2)))
    assert [type(each) for each in records(tmp_path)] == [HandRecord] * 3
    bench, net = records(tmp_path, format="dexgraspnet")[:1], records(tmp_path / "net.npy")
    assert bench[0].reason.startswith("the file is in none of the formats dexgraspnet;")
    assert [each.object for each in net] == ["net"] * 2
    with pytest.raises(InputError, match="format must be one of dexgraspbench, bodex"):
        records(tmp_path, format="other")
    assert all(each.meaning for each in FORMATS.values())


def test_paths_without_records_are_mistakes(tmp_path):
    with pytest.raises(InputError, match="no such file or folder"):
        read_records([tmp_path / "none"])
    (tmp_path / "a.txt").write_text("")
    with pytest.raises(InputError, match=r"no file ends in .json, .npy"):
        read_records([tmp_path])
    (found,) = records(tmp_path / "a.txt")
    assert "expected a file that ends in one of .npy" in found.reason


def test_results_beside_poses_are_left_out_of_folders(tmp_path):
    run_with_hand(tmp_path)
    assert [type(each) for each in records(tmp_path)] == [HandRecord]
    assert len(records(tmp_path / "grasps.json")) == 2
    (tmp_path / "other.json").write_text(json.dumps({"a": 1}))
    assert [type(each) for each in records(tmp_path)] == [BadRecord, HandRecord]


@pytest.mark.parametrize("ending", [".npy", ".npz", ".json", ".parquet"])
@pytest.mark.parametrize(
    "data",
    [b"", b"\0" * 100, b"[" * 100_000, b"PK\x03\x04", b"PAR1", b"\x93NUMPY\x01\0", b"null", b"[]",
     b"version https://git-lfs.github.com/spec/v1\n", b'{"joints_rad": 3}', b'{"reaches": 3}',
     b'{"grasps": {"a": 1}}', b'{"contacts": null}', b'[{"joints_rad": [1]}, 3, null]',
     b'[{"reaches": 1}]'],
    ids=lambda data: repr(data[:20]),
)  # fmt: skip
def test_whatever_a_file_holds_is_told(ending, data, tmp_path):
    (tmp_path / f"a{ending}").write_bytes(data)
    found = records(tmp_path)
    assert {type(each) for each in found} == {BadRecord}
    assert all(each.id.startswith(f"a{ending}") and each.reason for each in found)


def test_a_file_cut_anywhere_is_one_bad_record(tmp_path):
    data = save(tmp_path / "whole.npy").read_bytes()
    for end in range(0, len(data), 7):
        (tmp_path / "cut.npy").write_bytes(data[:end])
        (found,) = records(tmp_path / "cut.npy")
        assert (type(found), found.id) == (BadRecord, "cut.npy")


@pytest.mark.parametrize("kind", ["rows", "list"])
def test_ten_thousand_records_in_one_file_take_little_memory(kind, tmp_path, monkeypatch):
    monkeypatch.setitem(reading.CONTENTS, ".npy", (16 * MB, unpickled))  # what `read` sets aside
    count = 10_000 if kind == "rows" else 2_000
    if kind == "list":
        np.save(tmp_path / "list.npy", listed(net_tables(RNG, count)))
    else:
        save(tmp_path / "rows.npy", grasp_qpos=np.tile(qpos(RNG)[1], (count, 1)))
    tracemalloc.start()
    found = sum(type(each) is HandRecord for each in read_records([tmp_path]))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert (found, peak < 40 * MB) == (count, True), peak / MB


def test_errors_of_paths_name_them():
    with pytest.raises(gc.InputError, match="nowhere"):
        read_records([Path("nowhere")])
