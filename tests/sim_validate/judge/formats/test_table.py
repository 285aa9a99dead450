"""A table that any tool can write says the same as npz, Parquet and JSON."""

import io
import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from sim_validate.judge.formats import table
from sim_validate.judge.records import BadRecord
from tests.sim_validate.judge.recorded import random_pose, records, seven

COUNT = 5
ROOTS = [random_pose(np.random.default_rng(k)) for k in range(COUNT)]
JOINTS = np.random.default_rng(0).uniform(-1, 1, (COUNT, 3))
COLUMNS = {
    "object": [f"object {k}" for k in range(COUNT)], "scale": [0.1 * (k + 1) for k in range(COUNT)],
    "joint_names": ["a", "b", "c"], "root_pose": [seven(root).tolist() for root in ROOTS],
    "joints_rad": JOINTS.tolist(), "squeeze_joints_rad": (JOINTS + 0.1).tolist(),
    "pregrasp_joints_rad": (JOINTS - 0.1).tolist(), "note": ["left alone"] * COUNT,
    "pregrasp_root_pose": [seven(root).tolist() for root in ROOTS[::-1]],
}  # fmt: skip


def rows():
    each = {name: column for name, column in COLUMNS.items() if name != "joint_names"}
    return [{name: column[k] for name, column in each.items()} | {"joint_names": ["a", "b", "c"]}
            for k in range(COUNT)]  # fmt: skip


def write(kind, folder, columns=COLUMNS):
    if kind == "npz":
        np.savez(folder / "t.npz", **columns)
    elif kind == "compressed":
        np.savez_compressed(folder / "t.npz", **columns)
    elif kind == "json":
        (folder / "t.json").write_text(json.dumps(columns))
    elif kind == "json rows":
        (folder / "t.json").write_text(json.dumps(rows()))
    else:
        pq.write_table(pa.Table.from_pylist(rows()), folder / "t.parquet")


@pytest.mark.parametrize("kind", ["npz", "compressed", "json", "json rows", "parquet"])
def test_every_kind_of_file_says_the_same(kind, tmp_path):
    write(kind, tmp_path)
    found = records(tmp_path)
    assert [each.id.partition("#")[2] for each in found] == [*map(str, range(COUNT))]
    for k, each in enumerate(found):
        assert (each.object, each.scale) == (f"object {k}", pytest.approx(0.1 * (k + 1)))
        assert each.joint_names == ("a", "b", "c")
        assert each.grasp.root == pytest.approx(ROOTS[k], abs=1e-12)
        assert each.squeeze.root == pytest.approx(ROOTS[k], abs=1e-12)
        assert each.pregrasp.root == pytest.approx(ROOTS[-1 - k], abs=1e-12)
        assert each.grasp.joints.tolist() == JOINTS[k].tolist()
        assert each.squeeze.joints.tolist() == (JOINTS[k] + 0.1).tolist()
        assert each.axes.tolist() == np.eye(3).tolist()


def test_the_lines_of_the_docstring_write_a_table(tmp_path, monkeypatch):
    text = table.__doc__.partition("write one:\n\n")[2].partition("\n\n|")[0]
    monkeypatch.chdir(tmp_path)
    lines = "\n".join(line[4:] for line in text.splitlines())
    assert len(lines.splitlines()) == 10
    roots = np.array(ROOTS[:2])
    exec(lines, {"root_pose": roots, "joints": JOINTS[:2, :2], "squeezing": JOINTS[:2, :2]})  # noqa: S102
    found = records(tmp_path)
    assert [each.object for each in found] == ["mug", "bowl"]
    assert [each.scale for each in found] == [0.1, 0.1]
    assert found[1].grasp.root == pytest.approx(ROOTS[1])


@pytest.mark.parametrize("kind", ["npz", "json"])
def test_one_value_may_be_that_of_all_and_others_be_left_out(kind, tmp_path):
    own = {"object": "mug", "root_pose": COLUMNS["root_pose"], "joints_rad": COLUMNS["joints_rad"]}
    write(kind, tmp_path, own)
    for each in records(tmp_path):
        assert (each.object, each.scale, each.joint_names) == ("mug", 1.0, ())
        assert (each.pregrasp, each.squeeze) == (None, None)


@pytest.mark.parametrize("kind", [np.float32, ">f4", ">f8", np.float16])
def test_matrices_and_angles_may_have_few_digits(kind, tmp_path):
    np.savez(tmp_path / "t.npz", object="mug", root_pose=np.array(ROOTS, kind),
             joints_rad=np.asfortranarray(JOINTS.astype(kind)))  # fmt: skip
    for k, each in enumerate(records(tmp_path)):
        assert each.grasp.root == pytest.approx(ROOTS[k], abs=1e-3)
        assert each.grasp.joints == pytest.approx(JOINTS[k], abs=1e-3)


@pytest.mark.parametrize("kind", ["npz", "json", "parquet"])
def test_a_wrong_row_loses_only_itself(kind, tmp_path):
    columns = json.loads(json.dumps(COLUMNS))
    columns["joints_rad"][1][0] = float("nan")
    columns["root_pose"][2] = [0.0] * 7
    columns["scale"][3] = 0.0
    columns["object"][4] = ""
    if kind == "parquet":
        pq.write_table(pa.table({k: v for k, v in columns.items() if k != "joint_names"}),
                       tmp_path / "t.parquet")  # fmt: skip
    else:
        write(kind, tmp_path, columns)
    good, *bad = records(tmp_path)
    assert good.object == "object 0"
    for each, said in zip(bad, ("joints_rad", "quaternion", "scale", "object"), strict=True):
        assert isinstance(each, BadRecord)
        assert said in each.reason


@pytest.mark.parametrize(
    ("change", "said"),
    [({"joints_rad": JOINTS[:2].tolist()}, "joints_rad must have an entry for each of the 5"),
     ({"root_pose": 3.0}, "root_pose must have a pose for each grasp, got 3.0"),
     ({"object": None}, "object: missing"), ({"object": ["a"]}, "object must have an entry"),
     ({"object": [[1]] * COUNT}, "object"), ({"scale": "large"}, "scale must be"),
     ({"joint_names": ["a", "b"]}, "joint_names must be 3 different names"),
     ({"joint_names": "abc"}, "joint_names"), ({"joints_rad": ["abc"] * COUNT}, "joints_rad must"),
     ({"joints_rad": [[True, False, True]] * COUNT}, "joints_rad must")],
    ids=str,
)  # fmt: skip
def test_wrong_columns_are_named(change, said, tmp_path):
    write("json", tmp_path, COLUMNS | change)
    found = records(tmp_path)
    assert {type(each) for each in found} == {BadRecord}
    assert said in found[0].reason


def test_objects_in_an_npz_file_are_not_unpickled(tmp_path):
    np.savez(tmp_path / "t.npz", **COLUMNS | {"object": np.array(["a"] * COUNT, dtype=object)})
    (found,) = records(tmp_path)
    assert "allow_pickle=False" in found.reason


def test_files_that_claim_much_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(table, "MOST_COLUMN_BYTES", 20)
    write("parquet", tmp_path)
    (found,) = records(tmp_path)
    assert "bytes, over 20; write several" in found.reason


def test_damaged_files_are_bad_records_and_nothing_else(tmp_path):
    rng = np.random.default_rng(0)
    held = io.BytesIO()
    pq.write_table(pa.Table.from_pylist(rows()), held)
    write("npz", tmp_path)
    for ending, data in (
        (".parquet", held.getvalue()),
        (".npz", (tmp_path / "t.npz").read_bytes()),
    ):
        for _ in range(150):
            damaged = bytearray(data)
            damaged[rng.integers(len(data))] = rng.integers(256)
            path = tmp_path / f"damaged{ending}"
            path.write_bytes(damaged[: rng.integers(1, len(data) + 1)])
            assert records(path)
