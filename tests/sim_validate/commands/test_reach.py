"""The command `reach`: its file, its exit codes, and what it refuses."""

import dataclasses
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.files.json_text import record_of
from sim_validate.cli.console import Reporter
from sim_validate.cli.exit_codes import Exit
from sim_validate.cli.hand_flags import Reach
from sim_validate.commands import reach as simulated
from sim_validate.commands.reach import say_where_to_look
from sim_validate.files.result_folders import REACHES
from sim_validate.hands.execute_hand import held_by_hands
from sim_validate.hands.validate_hand import MOST_PUSH_N
from sim_validate.main import main
from sim_validate.records.reaches import ReachesFile, read_reaches
from tests.grasp_core.hands.gripping import plain_hand
from tests.hand_models import hand_mjcf
from tests.three_fingers import THREE_TIPS, three_fingers_file


@pytest.fixture(scope="module")
def grasps(tmp_path_factory):
    """The grasps of a built-in object that fits the hands as it is."""
    folder = tmp_path_factory.mktemp("reach")
    assert main(["plan", "l-bracket", "--limit", "3", "--out", str(folder), "-q"]) == Exit.GOOD
    return folder / "grasps.json"


def test_it_writes_poses_that_are_in_force_closure(grasps, tmp_path, capsys):
    code = main(["reach", str(grasps), "--out", str(tmp_path), "--jobs", "1"])
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


def test_it_says_which_command_shows_the_hand(grasps, tmp_path, capsys):
    for out, expected in ((grasps.parent, f"graspproof report {grasps.parent}\n"),
                          (tmp_path, "give the folder"), (None, "give the folder")):  # fmt: skip
        say_where_to_look(Reach(grasps, out=out), Reporter())
        assert expected in capsys.readouterr().out


def test_a_grasp_that_is_not_reached_is_a_negative_answer(grasps, tmp_path, capsys):
    """A hand whose fingers all bend the same way cannot enclose anything."""
    path = tmp_path / "plain.xml"
    path.write_text(hand_mjcf(plain_hand()))
    tips = ",".join(f"f{i}_tip" for i in range(4))
    code = main(["reach", str(grasps), "--hand", str(path), "--fingertips", tips, "--limit", "1",
                 "--starts", "5", "--json"])  # fmt: skip
    answer = json.loads(capsys.readouterr().out)
    assert code == Exit.NEGATIVE
    (only,) = answer["reaches"]
    assert only["pose"] is None
    assert "no pose was found" in only["explanation"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--hand", "nose"], "hand must be allegro, allegro-urdf, leap"),
        (["--hand", "allegro", "--fingertips", "a,b,c,d"], "has its own fingertips"),
        (["--hand", "absent.xml", "--fingertips", "a,b,c,d"], "cannot be read"),
        (["--grasp", "c-9-9-9-9"], "c-9-9-9-9"),
    ],
)
def test_what_cannot_be_asked_is_refused(words, said, grasps, capsys):
    assert main(["reach", str(grasps), *words]) in {Exit.INPUT, Exit.USAGE}
    assert said in capsys.readouterr().err


def test_three_fingers_stand_at_contacts_that_the_file_names(grasps, tmp_path, capsys):
    hand = ["--hand", three_fingers_file(tmp_path), "--fingertips", ",".join(THREE_TIPS)]
    code = main(["reach", str(grasps), *hand, "--out", str(tmp_path)])
    said = capsys.readouterr()
    record = record_of(ReachesFile, (tmp_path / REACHES).read_text(), REACHES, schema=1)
    assert record["summary"]["reached"] == 3, said
    assert code == Exit.GOOD
    for each, grasp in zip(record["reaches"], gc.load_grasps(grasps).grasps, strict=True):
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


def test_poses_of_coupled_joints_obey_and_are_kept_with_the_couplings(grasps, tmp_path):
    words = ["reach", str(grasps), *coupled_file(tmp_path), "--out", str(tmp_path), "-q"]
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
def test_what_needs_a_motor_at_each_joint_names_those_that_follow(flags, grasps, tmp_path, capsys):
    assert main(["reach", str(grasps), *coupled_file(tmp_path), *flags]) == Exit.INPUT
    said = capsys.readouterr().err
    assert f"{flags[0]} needs a hand with a motor at each joint" in said
    assert "left_curl follows left_bend, right_curl follows right_bend" in said


def test_where_no_three_contacts_close_the_command_says_so(tmp_path, capsys):
    assert main(["plan", "dodecahedron", "--limit", "1", "--out", str(tmp_path), "-q"]) == Exit.GOOD
    hand = ["--hand", three_fingers_file(tmp_path), "--fingertips", ",".join(THREE_TIPS)]
    words = ["reach", str(tmp_path / "grasps.json"), *hand, "--friction", "0.05"]
    assert main([*words, "--out", str(tmp_path)]) == Exit.NEGATIVE
    said = capsys.readouterr()
    assert "1 have no 3 contacts that are in force closure alone" in said.out
    assert "no 3 of the grasp's 4 contacts alone are in force closure at friction 0.05" in said.err
    record = record_of(ReachesFile, (tmp_path / REACHES).read_text(), REACHES, schema=1)
    assert record["summary"]["no_closure"] == 1
    assert record["reaches"][0]["reason"] == "no closure"


def test_a_simulated_hand_holds_and_its_grasps_are_ranked(grasps, tmp_path, capsys):
    shutil.copy(grasps, tmp_path / "grasps.json")
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


def test_a_hand_whose_motors_and_links_are_known_says_what_it_carries(grasps, tmp_path, capsys):
    shutil.copy(grasps, tmp_path / "grasps.json")
    words = ["reach", str(tmp_path / "grasps.json"), "--hand", "leap", "--out", str(tmp_path)]
    main([*words, "--jobs", "1"])
    said = capsys.readouterr().out
    assert "payload kg: the largest mass that the motors hold whichever way" in said
    record = record_of(ReachesFile, (tmp_path / REACHES).read_text(), REACHES, schema=1)
    reached = [each for each in record["reaches"] if each["reached"]]
    assert reached, said
    plan, hand = gc.load_grasps(grasps), gc.load_hand("leap")
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


def test_a_hand_whose_links_have_no_masses_or_are_too_heavy_says_nothing_of_it(
    grasps, tmp_path, capsys
):
    for words in (
        ["allegro", "--torque-limit-n-m", "0.35"],
        ["leap", "--torque-limit-n-m", "0.001"],
    ):
        out = tmp_path / words[0]
        main(["reach", str(grasps), "--hand", *words, "--out", str(out), "--jobs", "1"])
        assert "payload kg" not in capsys.readouterr().out
        record = record_of(ReachesFile, (out / REACHES).read_text(), REACHES, schema=1)
        reached = [each for each in record["reaches"] if each["reached"]]
        assert reached
        assert all("payload" not in each for each in reached)


def test_what_was_tried_before_an_interrupt_is_kept(grasps, tmp_path, monkeypatch):
    def one_and_stop(jobs, processes):
        yield from held_by_hands(jobs[:1], processes)
        raise KeyboardInterrupt

    monkeypatch.setattr(simulated, "held_by_hands", one_and_stop)
    words = ["reach", str(grasps), "--simulate", "--torque-limit-n-m", "0.35", "--jobs", "1"]
    assert main([*words, "--out", str(tmp_path)]) == Exit.INTERRUPTED
    record = record_of(ReachesFile, (tmp_path / REACHES).read_text(), REACHES, schema=1)
    assert not record["summary"]["complete"]
    reached = [each for each in record["reaches"] if each["reached"]]
    assert len(reached) >= 2
    assert ["simulated" in each for each in reached] == [True] + [False] * (len(reached) - 1)


def test_a_hand_without_torque_limits_is_not_simulated(grasps, capsys):
    assert main(["reach", str(grasps), "--simulate"]) == Exit.INPUT
    assert "give one for all joints with --torque-limit-n-m" in capsys.readouterr().err
    assert main(["reach", str(grasps), "--mass-kg", "0.1"]) == Exit.INPUT
    assert "--mass-kg needs a torque limit for each joint" in capsys.readouterr().err


def test_a_hand_executes_the_grasps_that_it_reaches(grasps, tmp_path, capsys):
    shutil.copy(grasps, tmp_path / "grasps.json")
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
    assert "Payload of the squeeze" in page
    trials = reached[0]["executed"]["execution"]
    said = f"survived {trials['trials'] - len(trials['lost'])} of {trials['trials']} trials"
    first = (tmp_path / "report" / "index.html").read_text()
    assert said in first
    assert "hand resists most" not in first  # nothing was simulated for it


def test_where_a_hand_loses_the_object_what_would_be_enough_is_said(grasps, tmp_path, capsys):
    shutil.copy(grasps, tmp_path / "grasps.json")
    words = ["reach", str(tmp_path / "grasps.json"), "--hand", "allegro", "--limit", "1"]
    words += ["--mass-kg", "2", "--torque-limit-n-m", "0.5", "--out", str(tmp_path)]
    assert main(words) == Exit.NEGATIVE
    record = record_of(ReachesFile, (tmp_path / REACHES).read_text(), REACHES, schema=1)
    (one,) = record["reaches"]
    enough = one["executed"]["enough"]
    assert enough["push_n"] is None
    assert enough["reason"].startswith("it is proved that no balanced squeeze within the torques")
    assert enough["reason"] in capsys.readouterr().err
    assert main(["report", str(tmp_path), "-q"]) == Exit.GOOD
    page = (tmp_path / "report" / "grasps" / f"{one['id']}.html").read_text()
    assert "What would be enough" in page


def test_a_hand_too_weak_for_an_object_says_so(grasps, tmp_path, capsys):
    words = ["reach", str(grasps), "--hand", "leap", "--limit", "1", "--mass-kg", "5"]
    code = main([*words, "--torque-limit-n-m", "0.01", "--out", str(tmp_path)])
    assert code == Exit.NEGATIVE
    record = record_of(ReachesFile, (tmp_path / REACHES).read_text(), REACHES, schema=1)
    (one,) = record["reaches"]
    assert one["reached"]
    assert one["executed"]["execution"] is None
    assert "cannot carry its own links" in one["executed"]["refused"]
    assert "not tried" in capsys.readouterr().out
