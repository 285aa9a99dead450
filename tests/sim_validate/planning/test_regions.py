"""`graspproof regions`: regions and proofs that a stranger can re-check from the files alone."""

import hashlib
import json

import numpy as np
import pytest

import grasp_core as gc
import sim_validate as sv
from grasp_core.records.grasps_json import grasps_from_json
from grasp_core.regions.proof import TwistCover
from scenes.example_objects import example_object
from sim_validate.commands.exit_codes import Exit
from sim_validate.main import main
from sim_validate.planning.regions import Regions

NAMES = ("axes", "codes", "forces")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("regions")
    assert main(["plan", "wedge", "--limit", "3", "--out", str(folder), "-q"]) == Exit.GOOD
    asked = ["regions", str(folder / "grasps.json"), "--max-cones", "300"]
    asked += ["--out", str(folder), "-q"]
    assert main(asked) == Exit.GOOD
    return folder


def test_every_grasp_has_regions_of_its_own(folder):
    planned = json.loads((folder / "grasps.json").read_text())
    text = (folder / "regions.json").read_text()
    assert Regions.of_text(text).text() == text
    found = json.loads(text)
    assert found["object"]["content_sha256"] == planned["object"]["content_sha256"]
    assert [each["id"] for each in found["grasps"]] == [each["id"] for each in planned["grasps"]]
    assert found["summary"] == {"grasps": 3, "proved": 3}
    for grasp in found["grasps"]:
        assert grasp["disc_radius_m"] > 0.0
        assert grasp["area_m2"] >= 4.0 * np.pi * grasp["inscribed_radius_m"] ** 2
        for region in grasp["regions"]:
            assert region["kind"] == "certified"
            assert region["inscribed_radius_m"] >= grasp["inscribed_radius_m"]
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


def test_one_grasp_with_a_reserve(folder, answer):
    without = json.loads((folder / "regions.json").read_text())["grasps"][0]
    asked = ["regions", folder / "grasps.json", "--grasp", without["id"], "--max-cones", "300"]
    found = answer(*asked, "--reserve", ".4")
    (grasp,) = found["grasps"]
    assert (grasp["id"], found["reserve"]) == (without["id"], 0.4)
    assert grasp["disc_radius_m"] < without["disc_radius_m"]


def test_where_nothing_can_be_proved_it_is_said(folder, capsys):
    planned = json.loads((folder / "grasps.json").read_text())["grasps"]
    grasp = max(planned, key=lambda each: each["critical_friction"])
    barely = str(grasp["critical_friction"] * (1.0 + 1e-7))
    asked = ["regions", str(folder / "grasps.json"), "--max-cones", "64"]
    asked += ["--grasp", grasp["id"], "--friction", barely]
    assert main(asked) == Exit.NEGATIVE
    assert "no regions for 1 of 1 grasps: " in capsys.readouterr().out


@pytest.mark.slow
def test_grasps_that_are_not_closed_do_not_stop_the_others(folder, tmp_path, capsys):
    grasps = json.loads((folder / "grasps.json").read_text())["grasps"]
    frictions = sorted(grasp["critical_friction"] for grasp in grasps)
    asked = ["regions", str(folder / "grasps.json"), "--max-cones", "2000", "--out", str(tmp_path)]
    between = str(0.99 * frictions[2])
    assert main([*asked, "--friction", between]) == Exit.NEGATIVE
    assert "no regions for 1 of 3 grasps: not in force closure" in capsys.readouterr().out
    found = json.loads((tmp_path / "regions.json").read_text())["grasps"]
    assert [grasp["regions"] is None for grasp in found].count(True) == 1
    assert len(list((tmp_path / "proofs").iterdir())) == 2
    for grasp in found:
        kept = tmp_path / "proofs" / f"{grasp['id']}.npz"
        assert kept.exists() == (grasp["regions"] is not None)
        if grasp["regions"]:
            assert grasp["proof"]["sha256"] == hashlib.sha256(kept.read_bytes()).hexdigest()


def test_a_proof_of_before_does_not_stay(folder, tmp_path):
    name = json.loads((folder / "grasps.json").read_text())["grasps"][0]["id"]
    asked = ["regions", str(folder / "grasps.json"), "--grasp", name, "--out", str(tmp_path), "-q"]
    kept = tmp_path / "proofs" / f"{name}.npz"
    assert main([*asked, "--max-cones", "300"]) == Exit.GOOD
    assert kept.exists()
    assert main([*asked, "--friction", "0.001"]) == Exit.NEGATIVE
    assert not kept.exists()


def test_files_give_back_the_regions_and_their_proof(folder):
    document = json.loads((folder / "regions.json").read_text())
    for grasp in document["grasps"]:
        found = sv.load_regions(folder / grasp["proof"]["file"])
        assert found.verify()
        assert found.radius == grasp["disc_radius_m"]
        for region, told in zip(found.regions, grasp["regions"], strict=True):
            np.testing.assert_array_equal(region.polygon, told["polygon_m"])
            assert region.inscribed_radius == pytest.approx(told["inscribed_radius_m"])


@pytest.mark.slow
def test_plans_may_come_with_certified_regions(tmp_path, folder):
    asked = ["plan", "wedge", "--limit", "3", "--regions", "--out", str(tmp_path), "-q"]
    assert main(asked) == Exit.GOOD
    plain = json.loads((folder / "grasps.json").read_text())["grasps"]
    found = grasps_from_json((tmp_path / "grasps.json").read_text()).grasps
    widened = 0
    for new, old in zip(found, plain, strict=True):
        assert new.id == old["id"]
        assert sv.load_regions(tmp_path / "proofs" / f"{new.id}.npz").verify()
        if new.regions[0].kind != "certified":
            assert new.radius == old["radius_m"]
            continue
        assert new.radius > old["radius_m"]
        widened += 1
    assert widened >= 2


@pytest.mark.slow
def test_a_run_keeps_regions_and_proofs_and_the_next_removes_them(tmp_path):
    asked = ["run", "tetrahedron", "--limit", "1", "--families", "concurrent"]
    asked += ["--out", str(tmp_path)]
    assert main([*asked, "--regions", "--no-report", "-q"]) == Exit.GOOD
    (grasp,) = json.loads((tmp_path / "grasps.json").read_text())["grasps"]
    assert grasp["regions"][0]["kind"] == "certified"
    assert sv.load_regions(tmp_path / "proofs" / f"{grasp['id']}.npz").verify()
    assert main([*asked, "--no-report", "-q"]) == Exit.GOOD
    assert not (tmp_path / "regions.json").exists()
    assert not list((tmp_path / "proofs").iterdir())


def test_regions_can_be_asked_to_stay_clear_of_edges(folder, answer):
    asked = ["regions", folder / "grasps.json", "--max-cones", "300", "--limit", "1"]
    near, clear = (
        answer(*asked, "--edge-clearance-m", clearance)["grasps"][0]["area_m2"]
        for clearance in (0.0, 0.006)
    )
    assert clear < near
    assert (
        answer(*asked, "--edge-clearance-m", "0.05", code=Exit.NEGATIVE)["summary"]["proved"] == 0
    )


def test_the_chance_of_closure_is_proved_where_errors_are_named(folder, capsys):
    asked = ["regions", str(folder / "grasps.json"), "--limit", "1", "--max-cones", "300", "--json"]
    off = ["--off-mm", "2", "--off-deg", "1", "--finger-mm", "0.5", "--friction-sigma", "0.05"]
    assert main([*asked, *off]) == Exit.GOOD
    (told,) = json.loads(capsys.readouterr().out)["grasps"]
    saved = grasps_from_json((folder / "grasps.json").read_text())
    found = gc.placement_probability(
        saved.body, saved.grasps[0], (0.5, 0.05), pose_sigma_m=2e-3,
        pose_sigma_rad=np.radians(1.0), contact_sigma_m=5e-4,
    )  # fmt: skip
    assert found.verify()
    assert told["closed_share"] == pytest.approx(found.lower, abs=1e-9)
    assert 0.9 < found.lower <= found.estimate
    kept = json.loads((folder / "regions.json").read_text())["grasps"]
    assert [each["closed_share"] for each in kept] == [None, None, None]
    assert {each["closed_share_reason"] for each in (told, *kept)} == {""}


def test_a_chance_that_is_not_proved_is_missing_with_its_reason(tmp_path, capsys):
    """Nothing is proved of patches, whose contacts are off their planes."""
    body, mesh = example_object("icosahedron"), tmp_path / "curved.obj"
    lines = ["v " + " ".join(map(repr, point)) for point in body.vertices.tolist()]
    lines += ["f " + " ".join(map(str, each)) for each in (body.triangles + 1).tolist()]
    mesh.write_text("\n".join(lines))
    flags = ["--faces", "patches", "--families", "concurrent", "--limit", "1"]
    assert main(["plan", str(mesh), *flags, "--out", str(tmp_path), "-q"]) == Exit.GOOD
    asked = ["regions", str(tmp_path / "grasps.json"), "--max-cones", "64", "--off-mm", "1"]
    main([*asked, "--json"])
    printed = capsys.readouterr()
    (told,) = json.loads(printed.out)["grasps"]
    assert told["closed_share"] is None
    assert "curved" in told["closed_share_reason"]
    main(asked)
    said = capsys.readouterr().out
    assert "no chance of closure proved for 1 of 1 grasps: the surface is curved" in said
    assert "0.000" not in said
