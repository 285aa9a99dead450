"""The command `analyze`: what it reads and refuses, and what it says of contacts."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.errors import UndecidedError
from sim_validate.commands.exit_codes import Exit
from sim_validate.main import main
from sim_validate.planning import analyze as analysis
from tests.judges import TETRA_CENTERS, TETRA_NORMALS


@pytest.fixture
def analyze(tmp_path, monkeypatch, capsys):
    """The exit code and the one document of `analyze --json` on a file with this content."""
    monkeypatch.chdir(tmp_path)

    def run(content, *flags):
        Path("contacts.json").write_text(json.dumps(content))
        code = main(["analyze", "contacts.json", "--json", *flags])
        return code, json.loads(capsys.readouterr().out)

    return run


CROSS = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
"""Four contacts that push towards the origin along x and y."""


def contacts(positions, normals):
    pairs = zip(np.asarray(positions).tolist(), np.asarray(normals).tolist(), strict=True)
    return [{"position_m": position, "normal": normal} for position, normal in pairs]


TETRAHEDRON = {
    "contacts": contacts(TETRA_CENTERS, TETRA_NORMALS), "friction": 0.5,
    "center_m": [0.0, 0.0, 0.0], "torque_scale_m": 1.0,
}  # fmt: skip


def arms_and_normals(grasp):
    """The contacts of an answer as seen from its center."""
    return np.array(grasp["positions_m"]) - grasp["center_m"], np.array(grasp["normals"])


def test_the_centers_of_a_tetrahedron(analyze):
    """By hand: four equal forces n_i / 4 have the margin 0.5 / 4; equal weights balance the 32
    edges; the torque part of G G' is (4/3 - 4/9) I, and smaller than the force part. The l1
    quality is bracketed by repeated qhull with exact support points.
    """
    code, document = analyze(TETRAHEDRON, "--max-normal-force-n", "5")
    (grasp,) = document["grasps"]
    assert code == Exit.GOOD
    assert (grasp["id"], grasp["closed"], grasp["outcome"]) == ("0", True, "closed")
    weakest, everywhere = grasp["weakest_axis_wrench"], grasp["resisted_in_every_direction_n"]
    assert everywhere == pytest.approx(5.0 * grasp["ferrari_canny_linf_n"][0], rel=1e-12)
    assert 0.0 < everywhere <= weakest["limit"] <= weakest["upper"]
    assert np.linalg.norm(weakest["wrench"]) == 1.0
    assert grasp["closure_margin"] == pytest.approx(0.125, abs=1e-9)
    assert grasp["critical_friction"] == 0.0
    lower, upper = grasp["ferrari_canny_l1_n"]
    assert lower <= 0.213202
    assert upper >= 0.213195
    assert upper - lower <= 1e-4 * upper
    assert grasp["verified"] == dict.fromkeys(
        ("closure", "ferrari_canny_l1_n", "ferrari_canny_linf_n"), True
    )
    assert grasp["min_weight"] == pytest.approx(1.0 / 32.0, abs=1e-9)
    assert grasp["smallest_singular_value"] == pytest.approx(np.sqrt(8.0 / 9.0), rel=1e-12)
    assert grasp["hull_volume"] > 0.0
    assert grasp["undecided"] == {}
    assert document["complete"] is True


def test_forces_and_separating_wrench_prove_themselves_from_the_document(analyze):
    """In plain sums, with only what the document says."""
    _, document = analyze({"grasps": [
        {"id": "closed", "contacts": contacts(TETRA_CENTERS + 2.0, TETRA_NORMALS)},
        {"id": "open", "contacts": contacts(TETRA_CENTERS[:2] + 2.0, TETRA_NORMALS[:2])},
    ], "friction": 0.5})  # fmt: skip
    closed, left = document["grasps"]
    arms, normals = arms_and_normals(closed)
    forces = np.array(closed["forces"])
    pushes = (forces * normals).sum(axis=1)
    assert np.abs(forces.sum(axis=0)).max() < 1e-9
    assert np.abs(np.cross(arms, forces).sum(axis=0)).max() < 1e-9
    assert (np.linalg.norm(forces - pushes[:, None] * normals, axis=1) < 0.5 * pushes).all()
    assert closed["separating_wrench"] is left["forces"] is None
    arms, normals = arms_and_normals(left)
    facing = np.array(left["separating_wrench"])
    velocities = facing[:3] + np.cross(facing[3:], arms)
    along = (velocities * normals).sum(axis=1)
    across = np.linalg.norm(velocities - along[:, None] * normals, axis=1)
    assert np.linalg.norm(facing) > 0.0
    assert (along + 0.5 * across <= 1e-9).all()


def test_two_contacts_are_never_closed(analyze):
    code, document = analyze({"contacts": contacts(CROSS[:2], -CROSS[:2]), "friction": 2.0})
    (grasp,) = document["grasps"]
    assert code == Exit.NEGATIVE
    assert (grasp["closed"], grasp["outcome"]) == (False, "open")
    assert grasp["critical_friction"] is None
    assert grasp["verified"]["closure"] is True
    assert grasp["resisted_in_every_direction_n"] == 0.0
    assert grasp["hull_volume"] == grasp["smallest_singular_value"] == 0.0
    _, document = analyze({"contacts": contacts(CROSS, [[0.0, 0, 1]] * 4), "friction": 0.0})
    assert document["grasps"][0]["min_weight"] is None  # of contacts that all push along z


def test_both_ends_of_the_critical_friction_are_shown(analyze, capsys):
    """Contacts on the sides of a box, each 0.2 aside of the middle and by turns 0.3 up and down."""
    turned = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, -1]])
    turns = [np.linalg.matrix_power(turned, i) for i in range(4)]
    sides = contacts([t @ [1.0, 0.2, 0.3] for t in turns], [t @ [-1.0, 0, 0] for t in turns])
    code, document = analyze({"contacts": sides, "friction": 0.5})
    (grasp,) = document["grasps"]
    lower, upper = grasp["critical_friction_interval"]
    assert code == Exit.GOOD
    assert lower <= 0.2 <= upper == grasp["critical_friction"]
    assert upper - lower <= 1e-7
    main(["analyze", "contacts.json"])
    words = " ".join(capsys.readouterr().out.split())
    shown = re.search(r"proved between ([0-9.]+) and ([0-9.]+)", words)
    assert lower - 1e-7 <= float(shown[1]) <= lower, "rounded down"
    assert upper <= float(shown[2]) <= upper + 1e-7, "rounded up"


def test_several_grasps_are_judged_one_by_one(analyze, capsys):
    file = {"grasps": [
        {"id": "four", "contacts": contacts(CROSS, -CROSS)},
        {"contacts": contacts(CROSS[:2], -CROSS[:2])},
        {"contacts": contacts(TETRA_CENTERS, TETRA_NORMALS)},
    ], "friction": 0.3}  # fmt: skip
    code, document = analyze(file)
    assert code == Exit.NEGATIVE
    assert [g["id"] for g in document["grasps"]] == ["four", "1", "2"]
    assert [g["closed"] for g in document["grasps"]] == [True, False, True]
    assert document["summary"] == {"grasps": 3, "closed": 2, "open": 1, "undecided": 0}
    assert main(["analyze", "contacts.json", "--wrench", "0", "0", "-1", "0", "0", "0"]) == code
    shown = capsys.readouterr().out
    assert "2 of 3 grasps are in" in shown


def test_a_load_along_the_axis_of_a_cross(analyze):
    """By hand: four contacts hold 0.5 x 10 N each, so -z is resisted up to 20 N; the forces of
    least norm for 2 N share it, 0.5 N each, with 1 N of normal force."""
    flags = "--wrench 0 0 -2 0 0 0 --wrench 0 0 -25 0 0 0"
    code, document = analyze({"contacts": contacts(CROSS, -CROSS), "friction": 0.5}, *flags.split())
    light, heavy = document["grasps"][0]["wrenches"]
    assert code == Exit.GOOD
    assert light["wrench"] == [0.0, 0.0, -2.0, 0.0, 0.0, 0.0]
    assert light["limit"] == pytest.approx(10.0, rel=1e-7)
    assert light["limit"] <= light["upper"] == pytest.approx(10.0, rel=1e-7)
    expected = np.array([[-1.0, 0, 0.5], [1, 0, 0.5], [0, -1, 0.5], [0, 1, 0.5]])
    assert np.array(light["least_norm_forces_n"]) == pytest.approx(expected, abs=1e-6)
    assert heavy["upper"] == pytest.approx(0.8, rel=1e-7)
    assert heavy["least_norm_forces_n"] is None


def test_center_and_scale_are_the_contacts_own_unless_given(analyze):
    """Measured so, moving and scaling the grasp changes nothing, to the gap of the bounds."""
    given = {"contacts": contacts(TETRA_CENTERS, TETRA_NORMALS), "friction": 0.5}
    moved = given | {"contacts": contacts(0.1 * TETRA_CENTERS + 3.0, TETRA_NORMALS)}
    (here,) = analyze(given)[1]["grasps"]
    (there,) = analyze(moved)[1]["grasps"]
    assert there["center_m"] == pytest.approx([3.0, 3.0, 3.0], rel=1e-12)
    assert there["torque_scale_m"] == pytest.approx(0.1 / np.sqrt(3.0), rel=1e-9)
    assert (there["center_from"], there["torque_scale_from"]) == (
        "mean contact", "farthest contact",
    )  # fmt: skip
    for name in ("ferrari_canny_l1_n", "ferrari_canny_linf_n"):
        assert there[name] == pytest.approx(here[name], rel=1e-4)
    (flagged,) = analyze(TETRAHEDRON, "--torque-scale-m", "2")[1]["grasps"]
    assert (flagged["torque_scale_m"], flagged["torque_scale_from"]) == (2.0, "flag")
    assert flagged["center_from"] == "file"


@pytest.mark.usefixtures("here")
def test_grasps_of_a_plan_are_measured_by_their_object(answer, capsys):
    assert main(["plan", "wedge", "--limit", "3", "--out", "p", "-q"]) == Exit.GOOD
    planned = json.loads(Path("p/grasps.json").read_text())
    document = answer("analyze", "p/grasps.json")
    assert len(document["grasps"]) == 3
    center = planned["object"]["center_of_mass_m"]
    vertices = np.array(planned["object"]["mesh"]["vertices_m"])
    for grasp, source in zip(document["grasps"], planned["grasps"], strict=True):
        assert grasp["id"] == source["id"]
        assert grasp["closure_margin"] == pytest.approx(source["closure_margin"], abs=1e-9)
        assert grasp["critical_friction"] == pytest.approx(source["critical_friction"], abs=1e-6)
        assert grasp["center_m"] == pytest.approx(center, abs=1e-15)
        radius = np.linalg.norm(vertices - center, axis=1).max()
        assert grasp["torque_scale_m"] == pytest.approx(radius, rel=1e-9)
        assert grasp["ferrari_canny_l1_n"] == pytest.approx(source["ferrari_canny"], rel=1e-4)
        assert set(grasp["friction"]) == {0.5}
    assert max(g["critical_friction"] for g in planned["grasps"]) > 0.01
    assert main(["analyze", "p/grasps.json", "--friction", "0.01", "-q"]) == Exit.NEGATIVE
    assert main(["analyze", "p/grasps.json", "--outward"]) == Exit.INPUT
    assert "--outward" in capsys.readouterr().err
    Path("none.json").write_text(json.dumps(planned | {"grasps": []}))
    assert main(["analyze", "none.json"]) == Exit.INPUT
    assert "none.json: grasps: the list is empty" in capsys.readouterr().err


def test_what_cannot_be_decided_is_named_and_the_rest_is_answered(analyze, monkeypatch, capsys):
    def undecided(*_):
        raise UndecidedError("too close to zero")

    monkeypatch.setattr(analysis, "force_closure", undecided)
    code, document = analyze(TETRAHEDRON)
    (grasp,) = document["grasps"]
    assert code == Exit.NEGATIVE
    assert (grasp["closed"], grasp["outcome"]) == (None, "undecided")
    assert grasp["undecided"] == {"closure": "too close to zero"}
    assert grasp["verified"]["closure"] is False
    assert grasp["critical_friction"] == 0.0
    assert grasp["ferrari_canny_l1_n"][0] > 0.2
    assert document["summary"]["undecided"] == 1
    assert main(["analyze", "contacts.json"]) == Exit.NEGATIVE
    assert "closure is undecided: too close to zero" in capsys.readouterr().out


def test_a_document_is_read_as_it_was_made(analyze):
    flags = ["--wrench", "0", "0", "-25", "0", "0", "0"]
    _, document = analyze({"contacts": contacts(CROSS, -CROSS), "friction": 0.5}, *flags)
    found = analysis.Analyses.of_text(json.dumps(document))
    assert json.loads(found.text()) == document
    assert found.grasps[0].wrenches[0].least_norm_forces_n is None


def refused(content, capsys, *flags):
    """What is said about a file that is refused."""
    text = content if isinstance(content, str) else json.dumps(content)
    Path("contacts.json").write_text(text)
    assert main(["analyze", "contacts.json", *flags]) == Exit.INPUT
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.count("\n") == 1
    assert shown.err.startswith("graspproof: contacts.json: ")
    return shown.err


def test_friction_is_that_of_the_contact_then_the_flag_then_the_file(analyze):
    file = {"contacts": contacts(CROSS, -CROSS), "friction": 0.5}
    file["contacts"][0]["friction"] = 0.9

    def used(*flags):
        return analyze(file, *flags)[1]["grasps"][0]["friction"]

    assert used() == [0.9, 0.5, 0.5, 0.5]
    assert used("--friction", "0.3") == [0.9, 0.3, 0.3, 0.3]
    del file["friction"]
    assert used("--friction", "0.2") == [0.9, 0.2, 0.2, 0.2]


def test_normals_are_turned_where_they_point_outward_and_made_unit_vectors(analyze):
    outward = TETRAHEDRON | {"contacts": contacts(TETRA_CENTERS, -np.round(TETRA_NORMALS, 3))}
    code, document = analyze(outward, "--outward")
    assert code == Exit.GOOD
    _, normals = arms_and_normals(document["grasps"][0])
    assert normals == pytest.approx(TETRA_NORMALS, abs=1e-12)


ONE, TWO, *_ = TETRAHEDRON["contacts"]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("[1]", "a contacts file must hold one JSON object, got a list"),
        (TETRAHEDRON | {"friction": None}, "contacts[0].friction: the key is missing"),
        ("{}", '"contacts" (one grasp) or "grasps" (several)'),
        (TETRAHEDRON | {"grasps": [{"contacts": [ONE, ONE]}]}, '"contacts" (one grasp)'),
        ({"contacts": TETRAHEDRON["contacts"]}, 'contacts[0].friction: the key is missing'),
        (TETRAHEDRON | {"mu": 0.5}, "no field is named 'mu'; choose from contacts, grasps"),
        (TETRAHEDRON | {"contacts": [ONE] * 3}, "all contacts lie within"),
        ({"contacts": [ONE, TWO | {"normal": [0, 0, 1.01]}]}, "contacts[1].normal: its length"),
        ({"contacts": [ONE, TWO | {"normal": [math.nan, 0, 1]}]}, "contacts[1].normal must be fin"),
        ({"grasps": [{"contacts": [ONE, ONE | {"normal": 1}]}]},
         "grasps[0].contacts[1].normal must have shape (3,)"),
        ({"grasps": [{"id": "1", "contacts": [ONE, ONE]}, {"contacts": [ONE, ONE]}]},
         "grasps[1].id: '1' is also that of grasps[0]"),
    ],
)  # fmt: skip
def test_a_file_is_refused_by_name_and_field(tmp_path, monkeypatch, capsys, content, words):
    monkeypatch.chdir(tmp_path)
    assert words in refused(content, capsys)


def test_a_file_that_is_missing_or_asks_too_much_is_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["analyze", "none.json"]) == Exit.INPUT
    assert "none.json: the file cannot be read" in capsys.readouterr().err
    Path("contacts.json").write_text(json.dumps(TETRAHEDRON))
    assert main(["analyze", "contacts.json", "--edges", "2501"]) == Exit.INPUT
    assert "--edges 2500 or less" in capsys.readouterr().err
    assert main(["analyze", "contacts.json", "--friction", "1001"]) == Exit.USAGE
    assert "--friction must be a number from 0 up to 1000" in capsys.readouterr().err


def test_a_config_file_gives_wrenches(analyze):
    Path("c.toml").write_text("wrench = [[0, 0, -1, 0, 0, 0], [1, 0, 0, 0, 0, 0.1]]\nedges = 6\n")
    _, document = analyze(TETRAHEDRON, "--config", "c.toml")
    asked = [found["wrench"] for found in document["grasps"][0]["wrenches"]]
    assert asked == [[0, 0, -1, 0, 0, 0], [1, 0, 0, 0, 0, 0.1]]
    assert document["edges"] == 6


@pytest.mark.parametrize(
    ("points", "inward"),
    [
        (CROSS[:2], -CROSS[:2]),  # two contacts, which never are in closure
        (np.eye(3), [[0.0, 0, 1]] * 3),  # all push one way, so that nothing balances
        (CROSS, -CROSS),
    ],
)
def test_what_is_printed_has_no_rounding_and_no_numbers_that_stand_for_words(
    analyze, capsys, points, inward
):
    for friction in (0.0, 0.5):
        analyze({"contacts": contacts(points, inward), "friction": friction})
        main(["analyze", "contacts.json", "--wrench", "0", "0", "-3", "0", "0", "0"])
        shown = capsys.readouterr().out
        assert not re.search(r"\d[eE][-+]\d|\binf\b|-0\b(?!\.)", shown), shown


def test_sentinels_and_endless_intervals_are_said_in_words(analyze, capsys):
    grasps = [{"contacts": contacts(CROSS[:2], -CROSS[:2])},
              {"contacts": contacts(np.eye(3), [[0.0, 0, 1]] * 3)}]  # fmt: skip
    _, document = analyze({"grasps": grasps, "friction": 0.5})
    assert document["grasps"][0]["weakest_axis"] == 0.0
    assert document["grasps"][1]["closure_margin"] == -1e6
    main(["analyze", "contacts.json"])
    assert "no balance" in capsys.readouterr().out
    Path("contacts.json").write_text(json.dumps({**grasps[0], "friction": 0.5}))
    main(["analyze", "contacts.json"])
    shown = " ".join(capsys.readouterr().out.split())
    assert "mu* is proved infinite: no friction is enough" in shown


def test_soft_fingertips_are_judged_with_their_torsion(analyze, capsys):
    """Two soft contacts resist torques about their line: 0.01 m times twice 10 N."""
    file = {"contacts": contacts(0.05 * CROSS[:2], -CROSS[:2]), "friction": 0.5}
    turn = ["--wrench", "1", "0", "0", "0", "0", "0", "--wrench", "0", "0", "0", "1", "0", "0"]
    code, document = analyze(file, "--torsion-m", "0.01", *turn)
    (grasp,) = document["grasps"]
    assert (code, document["torsion_m"]) == (Exit.GOOD, 0.01)
    assert grasp["closed"] is True
    assert grasp["verified"] == dict.fromkeys(grasp["verified"], True)
    proof = gc.force_closure(0.05 * CROSS[:2], -CROSS[:2], 0.5, torsion_m=0.01)
    assert grasp["closure_margin"] == pytest.approx(proof.margin)
    assert len(grasp["torques"]) == 2
    assert grasp["wrenches"][1]["limit"] == pytest.approx(0.2, rel=1e-6)
    assert grasp["ferrari_canny_l1_n"][0] > 0.0
    left_out = ("min_weight", "hull_volume", "smallest_singular_value",
                "critical_friction_interval")  # fmt: skip
    assert [grasp[name] for name in left_out] == [None] * 4
    assert grasp["wrenches"][0]["least_norm_forces_n"] is None
    assert json.loads(analysis.Analyses.of_text(json.dumps(document)).text()) == document
    assert main(["analyze", "contacts.json", "--torsion-m", "0.01"]) == Exit.GOOD
    assert "left out, because they are computed for hard fingertips" in capsys.readouterr().out
    assert "torsion_m must be zero where friction is" in refused(
        file | {"friction": 0.0}, capsys, "--torsion-m", "0.01"
    )
    assert main(["analyze", "contacts.json", "--torsion-m", "-1"]) == Exit.USAGE
