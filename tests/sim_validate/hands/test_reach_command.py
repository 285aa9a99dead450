"""The command `reach`: its file, its exit codes, and what it refuses."""

import dataclasses
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.files.json_text import record_of
from sim_validate.hands.reaches_json import ReachesFile, read_reaches
from sim_validate.hands.validate_hand import MOST_PUSH_N
from sim_validate.kit.exit_codes import Exit
from sim_validate.kit.result_folders import REACHES
from sim_validate.main import main
from tests.grasp_core.hands.gripping import plain_hand
from tests.hand_models import hand_mjcf
from tests.three_fingers import THREE_TIPS, three_fingers_file


def test_it_writes_poses_that_are_in_force_closure(bracket_plan, tmp_path, capsys):
    code = main(["reach", str(bracket_plan), "--out", str(tmp_path), "--jobs", "1"])
    said = capsys.readouterr().out
    text = (tmp_path / "reaches.json").read_text()
    record = record_of(ReachesFile, text, "reaches.json", schema=1)
    summary = record["summary"]
    assert summary["grasps"] == 3
    assert summary["complete"]
    assert summary["reached"] >= 2
    assert f"{summary['reached']} of 3 grasps were reached" in said
    assert "give the folder of grasps.json as --out" in said
    assert code == (Exit.GOOD if summary["reached"] == 3 else Exit.NEGATIVE)
    ends = ("reached", "limit", "collision", "not_found", "no_closure")
    assert sum(summary[key] for key in ends) == 3
    for each in record["reaches"]:
        assert (each["pose"] is not None) == each["reached"] == (each["reason"] == "")
        if each["pose"]:
            contacts = each["pose"]["contacts"]
            positions = np.array([contact["position_m"] for contact in contacts])
            normals = np.array([contact["normal"] for contact in contacts])
            assert gc.force_closure(positions, normals, record["friction"]).closed
            assert len(each["pose"]["joints_rad"]) == len(record["hand"]["joints"]) == 16
            assert len({contact["finger"] for contact in contacts}) == 4
            assert each["pose"]["used"] == [0, 1, 2, 3]


def test_a_grasp_that_is_not_reached_is_a_negative_answer(bracket_plan, tmp_path, capsys):
    """A hand whose fingers all bend the same way cannot enclose anything."""
    path = tmp_path / "plain.xml"
    path.write_text(hand_mjcf(plain_hand()))
    tips = ",".join(f"f{i}_tip" for i in range(4))
    code = main(["reach", str(bracket_plan), "--hand", str(path), "--fingertips", tips,
                 "--limit", "1", "--starts", "5", "--json"])  # fmt: skip
    answer = json.loads(capsys.readouterr().out)
    assert code == Exit.NEGATIVE
    (only,) = answer["reaches"]
    assert only["pose"] is None
    assert "no pose was found" in only["explanation"]


def test_a_hand_that_there_is_not_is_refused(bracket_plan, capsys):
    assert main(["reach", str(bracket_plan), "--hand", "nose"]) == Exit.INPUT
    assert "hand must be allegro, allegro-urdf, leap" in capsys.readouterr().err


def test_three_fingers_stand_at_contacts_that_the_file_names(bracket_plan, tmp_path, capsys):
    hand = ["--hand", three_fingers_file(tmp_path), "--fingertips", ",".join(THREE_TIPS)]
    code = main(["reach", str(bracket_plan), *hand, "--out", str(tmp_path)])
    said = capsys.readouterr()
    record = record_of(ReachesFile, (tmp_path / REACHES).read_text(), REACHES, schema=1)
    assert record["summary"]["reached"] == 3, said
    assert code == Exit.GOOD
    for each, grasp in zip(record["reaches"], gc.load_grasps(bracket_plan).grasps, strict=True):
        used, contacts = each["pose"]["used"], each["pose"]["contacts"]
        assert len(used) == len(contacts) == 3
        assert {contact["finger"] for contact in contacts} == set(THREE_TIPS)
        positions = np.array([contact["position_m"] for contact in contacts])
        normals = np.array([contact["normal"] for contact in contacts])
        assert gc.force_closure(positions, normals, record["friction"]).closed
        # each fingertip is on the face of the planned contact whose place it takes
        assert normals == pytest.approx(grasp.normals[used], abs=1e-6)
    saved, _ = read_reaches(tmp_path / REACHES)
    kept = {each["id"]: each["pose"]["used"] for each in record["reaches"]}
    assert {name: each.used.tolist() for name, each in saved.found.items()} == kept


def coupled_file(folder):
    """The gripper with fingers that curl as they bend."""
    path = three_fingers_file(folder)
    text = Path(path).read_text()
    rules = "".join(
        f'<joint joint1="{each}_curl" joint2="{each}_bend"/>' for each in ("left", "right")
    )
    Path(path).write_text(text.replace("</mujoco>", f"<equality>{rules}</equality></mujoco>"))
    return ["--hand", path, "--fingertips", ",".join(THREE_TIPS)]


def test_poses_of_coupled_joints_obey_and_are_kept_with_the_couplings(bracket_plan, tmp_path):
    words = ["reach", str(bracket_plan), *coupled_file(tmp_path), "--out", str(tmp_path), "-q"]
    main(words)
    text = (tmp_path / REACHES).read_text()
    record = record_of(ReachesFile, text, REACHES, schema=1)
    assert record["summary"]["reached"] >= 1
    names = record["hand"]["joints"]
    for each in record["reaches"]:
        for key in ("joints_rad", "pregrasp_joints_rad"):
            if each["pose"] and each["pose"][key]:
                angles = dict(zip(names, each["pose"][key], strict=True))
                for finger in ("left", "right"):
                    assert abs(angles[f"{finger}_curl"] - angles[f"{finger}_bend"]) <= 1e-9
    saved, _ = read_reaches(tmp_path / REACHES)
    assert [(c.joint, c.driver, c.ratio) for c in saved.hand.couplings] == [
        ("left_curl", "left_bend", 1.0), ("right_curl", "right_bend", 1.0),
    ]  # fmt: skip


@pytest.mark.parametrize("flags", [("--simulate",), ("--mass-kg", "0.05")])
def test_what_needs_a_motor_at_each_joint_names_the_others(flags, bracket_plan, tmp_path, capsys):
    assert main(["reach", str(bracket_plan), *coupled_file(tmp_path), *flags]) == Exit.INPUT
    said = capsys.readouterr().err
    assert f"{flags[0]} needs a hand with a motor at each joint" in said
    assert "left_curl follows left_bend, right_curl follows right_bend" in said


def test_a_simulated_hand_holds_and_its_grasps_are_ranked(bracket_plan, tmp_path, capsys):
    shutil.copy(bracket_plan, tmp_path / "grasps.json")
    words = ["reach", str(tmp_path / "grasps.json"), "--hand", "allegro", "--limit", "2"]
    code = main([*words, "--simulate", "--torque-limit-n-m", "0.35", "--out", str(tmp_path)])
    said = capsys.readouterr().out
    record = record_of(ReachesFile, (tmp_path / REACHES).read_text(), REACHES, schema=1)
    reached = [each for each in record["reaches"] if each["reached"]]
    assert reached, said
    assert code == (Exit.GOOD if len(reached) == 2 else Exit.NEGATIVE)
    for each in reached:
        held = each["simulated"]
        assert held["held"]
        assert held["wrenches"] == 13
        assert len(held["controls"]) >= 3
        assert all(control["let_go"] for control in held["controls"])
        assert held["weakest_n"] > 0.1
    assert f"{len(reached)} of {len(reached)} hands held all wrenches" in said
    best = max(reached, key=lambda each: each["simulated"]["weakest_n"])["id"]
    ranked = said[said.index("with its motors") :]
    assert min((ranked.index(each["id"]), each["id"]) for each in reached)[1] == best
    assert main(["report", str(tmp_path), "-q"]) == Exit.GOOD
    page = (tmp_path / "report" / "grasps" / f"{best}.html").read_text()
    assert "Held with its motors" in page
    assert "13 of 13 wrenches" in page
    first = (tmp_path / "report" / "index.html").read_text()
    assert '<option value="-hand">hand resists most</option>' in first
    for each in reached:
        assert f'data-hand="{each["simulated"]["weakest_n"]}"' in first


def test_a_hand_of_known_motors_and_links_says_what_it_carries(bracket_plan, tmp_path, capsys):
    shutil.copy(bracket_plan, tmp_path / "grasps.json")
    words = ["reach", str(tmp_path / "grasps.json"), "--hand", "leap", "--out", str(tmp_path)]
    main([*words, "--jobs", "1"])
    said = capsys.readouterr().out
    assert "payload kg: the largest mass that the motors hold whichever way" in said
    record = record_of(ReachesFile, (tmp_path / REACHES).read_text(), REACHES, schema=1)
    reached = [each for each in record["reaches"] if each["reached"]]
    assert reached, said
    plan, hand = gc.load_grasps(bracket_plan), gc.load_hand("leap")
    saved, _ = read_reaches(tmp_path / REACHES)
    for each in reached:
        found = each["payload"]
        assert 0.0 < found["lower_kg"] <= found["upper_kg"] <= 1.002 * found["lower_kg"]
        assert f"{found['lower_kg']:.3g}" in said
        load = np.append(9.80665 * np.array(found["weakest_gravity"]), np.zeros(3))
        kept = saved.found[each["id"]]
        closed = gc.force_closure(kept.contacts, friction=record["friction"])
        reach = dataclasses.replace(kept, certificate=closed)
        motors = gc.hand_motors(hand, reach, down=found["weakest_gravity"])
        held = gc.wrench_limits(
            reach.contacts, None, record["friction"], [load], max_normal_force=MOST_PUSH_N,
            center=plan.body.center_of_mass, motors=motors,
        )[0].limit  # fmt: skip
        assert held == pytest.approx(found["upper_kg"], rel=2e-3)  # twice the gap of the bounds
    assert main(["report", str(tmp_path), "-q"]) == Exit.GOOD
    page = (tmp_path / "report" / "grasps" / f"{reached[0]['id']}.html").read_text()
    assert "Payload in any orientation" in page


def test_a_hand_without_torque_limits_is_not_simulated(bracket_plan, capsys):
    assert main(["reach", str(bracket_plan), "--simulate"]) == Exit.INPUT
    assert "give one for all joints with --torque-limit-n-m" in capsys.readouterr().err
    assert main(["reach", str(bracket_plan), "--mass-kg", "0.1"]) == Exit.INPUT
    assert "--mass-kg needs a torque limit for each joint" in capsys.readouterr().err


def test_a_hand_executes_the_grasps_that_it_reaches(bracket_plan, tmp_path, capsys):
    shutil.copy(bracket_plan, tmp_path / "grasps.json")
    words = ["reach", str(tmp_path / "grasps.json"), "--hand", "allegro", "--limit", "2"]
    main([*words, "--mass-kg", "0.05", "--torque-limit-n-m", "0.5", "--out", str(tmp_path)])
    said = capsys.readouterr().out
    record = record_of(ReachesFile, (tmp_path / REACHES).read_text(), REACHES, schema=1)
    assert record["summary"]["complete"]
    reached = [each for each in record["reaches"] if each["reached"]]
    assert reached, said
    for each in reached:
        assert "simulated" not in each
        found = each["executed"]["execution"]
        assert found["mass_kg"] == 0.05
        assert found["trials"] >= 20
        assert found["survived"] == (not found["lost"])
        assert found["controls_held"] == []
        assert found["payload_kg"] > 0.05
        assert found["tip_radius_m"] == [0.012] * len(found["squeeze_n"])
        assert (each["executed"]["enough"] is None) == found["survived"]
    assert record["asked"]["execution"]["knock_n_s"] == pytest.approx(0.05 / 6.0)
    assert record["asked"]["execution"]["mass_kg"] == 0.05
    survived = [each for each in reached if each["executed"]["execution"]["survived"]]
    assert f"{len(survived)} of {len(reached)} grasps survived every trial with the hand" in said
    assert main(["report", str(tmp_path), "-q"]) == Exit.GOOD
    page = (tmp_path / "report" / "grasps" / f"{reached[0]['id']}.html").read_text()
    assert "Executed with the hand" in page
    trials = reached[0]["executed"]["execution"]
    said = f"survived {trials['trials'] - len(trials['lost'])} of {trials['trials']} trials"
    first = (tmp_path / "report" / "index.html").read_text()
    assert said in first
    assert "hand resists most" not in first  # nothing was simulated for it


def test_where_a_hand_loses_the_object_what_would_be_enough_is_said(bracket_plan, tmp_path, capsys):
    shutil.copy(bracket_plan, tmp_path / "grasps.json")
    words = ["reach", str(tmp_path / "grasps.json"), "--hand", "allegro", "--limit", "1"]
    words += ["--mass-kg", "2", "--torque-limit-n-m", "0.5", "--out", str(tmp_path)]
    assert main(words) == Exit.NEGATIVE
    record = record_of(ReachesFile, (tmp_path / REACHES).read_text(), REACHES, schema=1)
    (one,) = record["reaches"]
    enough = one["executed"]["enough"]
    assert enough["push_n"] is None
    assert enough["reason"].startswith("it is proved that no balanced squeeze within the torques")
    assert enough["reason"] in capsys.readouterr().err


def test_a_hand_too_weak_for_an_object_says_so(bracket_plan, tmp_path, capsys):
    words = ["reach", str(bracket_plan), "--hand", "leap", "--limit", "1", "--mass-kg", "5"]
    code = main([*words, "--torque-limit-n-m", "0.01", "--out", str(tmp_path)])
    assert code == Exit.NEGATIVE
    record = record_of(ReachesFile, (tmp_path / REACHES).read_text(), REACHES, schema=1)
    (one,) = record["reaches"]
    assert one["reached"]
    assert one["executed"]["execution"] is None
    assert "cannot carry its own links" in one["executed"]["refused"]
    assert "not tried" in capsys.readouterr().out
