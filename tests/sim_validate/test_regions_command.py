"""`graspproof regions`: regions and proofs that a stranger can re-check from the files alone."""

import json

import numpy as np
import pytest

from grasp_core.records import grasps_from_json
from grasp_core.twist_covers import TwistCover
from sim_validate.cli import Exit, main

NAMES = ("axes", "codes", "forces")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("regions")
    assert main(["plan", "wedge", "--limit", "3", "--out", str(folder), "-q"]) == Exit.GOOD
    asked = ["regions", str(folder / "grasps.json"), "--cones", "1000", "--out", str(folder), "-q"]
    assert main(asked) == Exit.GOOD
    return folder


def test_every_grasp_has_regions_of_its_own(folder):
    planned = json.loads((folder / "grasps.json").read_text())
    found = json.loads((folder / "regions.json").read_text())
    assert found["object"]["content_sha256"] == planned["object"]["content_sha256"]
    assert [each["id"] for each in found["grasps"]] == [each["id"] for each in planned["grasps"]]
    for grasp in found["grasps"]:
        assert grasp["radius_m"] > 0.0
        for region in grasp["regions"]:
            assert region["kind"] == "certified"
            assert region["area_m2"] >= np.pi * region["inscribed_radius_m"] ** 2
            assert np.shape(region["polygon_m"])[1] == 3


def test_the_proofs_can_be_checked_from_their_files(folder):
    checked = 0
    for path in sorted((folder / "proofs").iterdir()):
        with np.load(path, allow_pickle=False) as kept:
            proof = {name: kept[name] for name in kept.files}
        cover = TwistCover(**{name: proof[name] for name in NAMES})
        regions = [(proof[f"region{i}_m"] - proof["origin_m"]) / proof["scale_m"] for i in range(4)]
        friction = proof["friction"]
        assert not proof["depths_m"].any()
        assert cover.verify(regions, proof["normals"], friction)
        assert not cover.verify(regions, proof["normals"], 0.9 * friction)
        assert not cover.verify([1.3 * region for region in regions], proof["normals"], friction)
        checked += 1
    assert checked == 3


def test_processes_and_runs_agree(folder, tmp_path):
    grasps = str(folder / "grasps.json")
    for jobs in ("1", "2"):
        out = tmp_path / jobs
        asked = ["regions", grasps, "--cones", "1000", "--jobs", jobs, "--out", str(out), "-q"]
        assert main(asked) == Exit.GOOD
        assert (out / "regions.json").read_bytes() == (folder / "regions.json").read_bytes()


def test_one_grasp_with_a_reserve(folder, capsys):
    name = json.loads((folder / "grasps.json").read_text())["grasps"][0]["id"]
    asked = ["regions", str(folder / "grasps.json"), "--grasp", name, "--cones", "1000", "--json"]
    assert main([*asked, "--reserve", ".4"]) == Exit.GOOD
    found = json.loads(capsys.readouterr().out)
    (grasp,) = found["grasps"]
    assert (grasp["id"], found["reserve"]) == (name, 0.4)
    assert main(asked) == Exit.GOOD
    (without,) = json.loads(capsys.readouterr().out)["grasps"]
    assert grasp["radius_m"] < without["radius_m"]


def test_where_nothing_can_be_proved_it_is_said(folder, capsys):
    planned = json.loads((folder / "grasps.json").read_text())["grasps"]
    grasp = max(planned, key=lambda each: each["critical_friction"])
    barely = str(grasp["critical_friction"] * (1.0 + 1e-7))
    asked = ["regions", str(folder / "grasps.json"), "--cones", "64"]
    asked += ["--grasp", grasp["id"], "--friction", barely]
    assert main(asked) == Exit.NEGATIVE
    assert "none proved" in capsys.readouterr().out


def test_what_is_wrong_is_refused(folder, capsys):
    grasps = str(folder / "grasps.json")
    assert main(["regions", grasps, "--grasp", "none"]) == Exit.INPUT
    assert "no grasp none" in capsys.readouterr().err
    assert main(["regions", grasps, "--friction", "0.001"]) == Exit.INPUT
    assert "not in force closure" in capsys.readouterr().err
    assert main(["regions", grasps, "--cones", "1"]) == Exit.USAGE


def test_plans_may_come_with_certified_regions(tmp_path, folder):
    asked = ["plan", "wedge", "--limit", "3", "--regions", "--out", str(tmp_path), "-q"]
    assert main(asked) == Exit.GOOD
    plain = json.loads((folder / "grasps.json").read_text())["grasps"]
    found = json.loads((tmp_path / "grasps.json").read_text())["grasps"]
    widened = 0
    for new, old in zip(found, plain, strict=True):
        assert new["contacts"] == old["contacts"]
        assert new["radius_m"] >= old["radius_m"]
        widened += new["regions"][0]["kind"] == "certified"
        if new["regions"][0]["kind"] == "certified":
            radii = [region["inscribed_radius_m"] for region in new["regions"]]
            assert new["radius_m"] == min(radii) > old["radius_m"]
    assert widened >= 2


def test_regions_of_plans_stay_clear_of_edges(tmp_path):
    asked = ["plan", "octahedron", "--limit", "1", "--family", "regulus", "--regions"]
    for clear in ("0", "0.002"):
        out = tmp_path / clear
        assert main([*asked, "--edge-clearance-m", clear, "--out", str(out), "-q"]) == Exit.GOOD
    text = (tmp_path / "0.002" / "grasps.json").read_text()
    saved = grasps_from_json(text)
    (grasp,) = saved.grasps
    for region, index in zip(grasp.regions, grasp.faces, strict=True):
        face = saved.body.faces[index]
        border = face.polygon
        edges = np.roll(border, -1, axis=0) - border
        inward = np.cross(face.normal, edges) / np.linalg.norm(edges, axis=1, keepdims=True)
        inside = np.einsum("ki,cki->ck", inward, region.polygon[:, None] - border)
        assert inside.min() > 0.002 - 1e-9


def test_fingers_on_one_face_and_certified_regions_do_not_go_together(capsys):
    asked = ["plan", "wedge", "--regions", "--share-faces-m", "0.01"]
    assert main(asked) == Exit.INPUT
    assert "leave it or --share-faces-m out" in capsys.readouterr().err


@pytest.mark.parametrize("flags", [["--balance", "area"], ["--recenter"]])
def test_other_balances_are_said_in_the_file(folder, flags, capsys):
    asked = ["regions", str(folder / "grasps.json"), "--limit", "1", "--cones", "500", "--json"]
    assert main([*asked, *flags]) == Exit.GOOD
    found = json.loads(capsys.readouterr().out)
    assert (found["balance"], found["recenter"]) == (
        ("area", False) if "area" in flags else ("radius", True)
    )
