"""What is wrong with a dataset is named: files, rows, and what comes out otherwise."""

import dataclasses
import json
import shutil

import numpy as np
import pytest
import trimesh

import grasp_core as gc
from sim_validate import load_dataset
from sim_validate.datasets.build import build
from sim_validate.datasets.manifest import read_manifest, write_manifest
from sim_validate.datasets.verify import verify
from tests.sim_validate.changing import changed
from tests.sim_validate.datasets.configs import CONFIG, rows_of
from tests.sim_validate.datasets.engines import Here, contents, silent
from tests.sim_validate.datasets.forging import first, forged, relisted

pytest.importorskip("pyarrow")


def test_one_byte_changed_in_a_file_of_any_kind_is_named(dataset, tmp_path):
    names = [path for path in contents(dataset) if path != "manifest.json"]
    files = {path.rpartition("/")[0] or path: path for path in names}
    assert len(files) >= 7
    for path in files.values():
        spoiled = shutil.copytree(dataset, tmp_path / "spoiled")
        data = bytearray((spoiled / path).read_bytes())
        if data:
            data[len(data) // 2] ^= 1
        else:
            data += b"x"
        (spoiled / path).write_bytes(bytes(data))
        assert any(path in fault for fault in verify(spoiled))
        (spoiled / path).unlink()
        assert f"{path}: this file is listed in the manifest, but missing" in verify(spoiled)
        shutil.rmtree(spoiled)


def leaning(rows):
    """A normal that is not the surface's, with the margin it gives."""
    row = rows[0]
    normal = np.array(row["contact_normals"][0]) + np.array([0.1, 0.0, 0.05])
    row["contact_normals"][0] = (normal / np.linalg.norm(normal)).tolist()
    points, normals = row["contact_points_m"], row["contact_normals"]
    row["closure_margin"] = gc.force_closure(points, normals, row["friction"]).margin


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("grasps", first(closure_margin=0.9), "closure_margin is"),
        ("grasps", first(contact_normals=[[2.0, 0.0, 0.0]] * 4), "must be unit vectors"),
        ("grasps", lambda rows: rows[0].update(held=not rows[0]["held"]), "held is"),
        ("grasps", first(object_id="0" * 64), "in object_id, has no row"),
        ("grasps", first(force_closed=False), "force_closed is"),
        ("grasps", first(contact_points_m=[[1.0, 0.0, 0.0]] * 4), "not on the object"),
        (
            "grasps",
            first(label="given", outcome="not_tried", held=None, trials=0),
            "claims results, although",
        ),
        ("grasps", first(trials=0), "must have trials"),
        ("grasps", first(trials=1), "by the table of trials"),
        ("grasps", first(friction=0.9), "not among those of config"),
        ("grasps", first(friction=-1.0), "friction must be a number from"),
        ("grasps", first(closure_margin=None), "closure_margin must be"),
        ("grasps", first(outcome="slipped"), "is 'slipped'"),
        ("grasps", leaning, "not with its normals"),
        ("grasps", first(split="validation"), "rows of another split"),
        ("trials", lambda rows: rows.pop(), "table of trials"),
        ("trials", first(grasp_id="nobody"), "nobody, named in grasp_id"),
        ("trials", first(outcome="slipped"), "table of trials"),
    ],
)
def test_rows_that_contradict_each_other_are_named(copy, name, change, message):
    forged(copy, name, change)
    assert any(message in fault for fault in verify(copy))


def shifted(rows, column):
    row = next(row for row in rows if row[column])
    row[column] *= 1.0 + 1e-4


def quarantined(folder):
    """Remove a grasp, and all that was made from it, from the tables."""
    (first, *_) = rows_of(folder, "grasps")
    gone = first["grasp_id"]

    def is_kept(row):
        of_it = gone in (row["grasp_id"], row.get("control_of"))
        return not (of_it or row["grasp_id"].startswith(f"{gone}:"))

    for name in ("grasps", "trials"):
        forged(folder, name, lambda rows: rows.__setitem__(slice(None), filter(is_kept, rows)))
    return gone


def test_what_comes_out_otherwise_is_named(copy):
    gone = quarantined(copy)
    changes = [
        ("objects", lambda rows: shifted(rows, "volume_m3"), "volume_m3 is"),
        ("grasps", lambda rows: shifted(rows, "ferrari_canny_lower_n"), "ferrari_canny_lower_n is"),
        ("grasps", lambda rows: rows[-1].update(family="pencil"), "family is pencil"),
        ("trials", lambda rows: rows[-1].update(name="gravity"), "name is gravity"),
        ("trials", lambda rows: shifted(rows, "displacement_m"), "displacement_m is"),
    ]
    for name, change, _ in changes:
        forged(copy, name, change)
    assert verify(copy) == []
    faults = verify(copy, 1.0)
    for _, _, message in changes:
        assert any(message in fault for fault in faults), message
    assert any(gone in fault and "has no row" in fault for fault in faults)


def test_with_other_rounding_verdicts_and_critical_frictions_count(copy):
    write_manifest(copy, dataclasses.replace(read_manifest(copy), arithmetic="another"))
    forged(copy, "trials", lambda rows: shifted(rows, "displacement_m"))
    forged(copy, "grasps", lambda rows: shifted(rows, "ferrari_canny_lower_n"))
    forged(copy, "grasps", lambda rows: shifted(rows, "critical_friction"))
    (fault,) = verify(copy, 1.0)
    assert "critical_friction is" in fault


@pytest.mark.slow
def test_objects_of_the_same_file_name_are_told_apart(tmp_path):
    for folder, sides in (("a", (0.04, 0.05, 0.06)), ("b", (0.04, 0.05, 0.07))):
        (tmp_path / folder).mkdir()
        trimesh.creation.box(extents=sides).export(tmp_path / folder / "model.obj")
    bad = tmp_path / "b" / "model.obj"
    bad.write_text(bad.read_text().rpartition("f ")[0])
    paths = (str(tmp_path / "a" / "model.obj"), str(bad))
    config = dataclasses.replace(CONFIG, objects=paths, frictions=(0.5,))
    built = build(config, tmp_path / "ds", Here(), silent)
    assert built.manifest.quarantined == 1
    assert verify(tmp_path / "ds", 1.0) == []


def test_what_is_quarantined_has_no_rows(copy):
    (row, *_) = rows_of(copy, "objects")
    line = {"object": "x", "source_sha256": row["source_sha256"], "given": [], "reason": "no"}
    lines = [json.dumps(line | {"friction": friction}) for friction in CONFIG.frictions]
    path = copy / "quarantine.jsonl"
    path.write_text("\n".join(lines) + "\n")
    relisted(copy, path, quarantined=2)
    assert sum("left out, but it has rows" in fault for fault in verify(copy, 1.0)) == 2


def test_settings_that_are_not_the_manifests_are_named(copy):
    path = copy / "config.toml"
    path.write_text(path.read_text().replace("limit = 2", "limit = 3"))
    relisted(copy, path)
    assert any("not the configuration" in fault for fault in verify(copy))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda r: r["files"][0].update(path="../x"), r"files\[0\]: path: expected a relative"),
        (lambda r: r.update(schema=4), "schema: expected 3, got 4: a newer graspproof wrote"),
        (lambda r: r["files"].append(r["files"][0]), "must have every path only once"),
    ],
)
def test_a_manifest_that_is_none_is_refused_by_field(copy, change, words):
    changed(copy / "manifest.json", change)
    with pytest.raises(gc.InputError, match=rf"manifest\.json: .*{words}"):
        verify(copy)
    with pytest.raises(gc.InputError, match=words):
        load_dataset(copy)


def test_links_out_of_a_dataset_are_not_followed(copy, tmp_path):
    path = next(copy.glob("data/grasps/*.parquet"))
    path.rename(tmp_path / "elsewhere")
    path.symlink_to(tmp_path / "elsewhere")
    assert any("leads out of" in fault for fault in verify(copy))
    with pytest.raises(gc.InputError, match="leads out of"):
        load_dataset(copy)


def test_nothing_is_loaded_where_any_byte_is_another(copy):
    path = next(copy.glob("data/trials/*.parquet"))
    whole = path.read_bytes()
    for data in (whole[:-1], b"", whole + b"x", whole[:40] + bytes([whole[40] ^ 1]) + whole[41:]):
        path.write_bytes(data)
        with pytest.raises(gc.InputError, match=rf"{path.name}: .* differs from what"):
            load_dataset(copy)
    path.unlink()
    with pytest.raises(gc.InputError, match=rf"{path.name}: .* missing"):
        load_dataset(copy)


def test_a_line_of_the_quarantine_that_is_none_is_named(copy):
    path = copy / "quarantine.jsonl"
    path.write_text('{"object": "wedge"}\n')
    relisted(copy, path)
    (fault,) = verify(copy)
    assert "quarantine.jsonl: line 1: source_sha256: missing; add it" in fault


def test_cells_that_must_not_be_null_are_a_fault_not_a_crash(copy):
    forged(copy, "grasps", first(friction=None, contacts=None, outcome=None))
    assert any("grasps" in fault or "a row is not" in fault for fault in verify(copy))
