"""The command `reach`: its file, its exit codes, and what it refuses."""

import shutil

import pytest

import grasp_core as gc
from grasp_core.files.file_kinds import REACHES
from sim_validate.commands.exit_codes import Exit
from sim_validate.files.results_folder import NEAREST_PICTURE
from sim_validate.hands.reaches import Reaches
from sim_validate.main import main


def test_it_writes_poses_that_are_in_force_closure(bracket_plan, tmp_path, capsys):
    code = main(["reach", str(bracket_plan), "--out", str(tmp_path), "--jobs", "1"])
    said = capsys.readouterr().out
    found = Reaches.read(tmp_path / REACHES)
    summary = found.summary
    assert summary["grasps"] == 3
    assert found.complete
    assert summary["reached"] >= 2
    assert f"{summary['reached']} of 3 grasps were reached" in said
    assert "give the folder of grasps.json as --out" in said
    assert code == (Exit.GOOD if summary["reached"] == 3 else Exit.NEGATIVE)
    ends = ("too_large", "too_small", "palm", "limit", "collision", "not_found", "no_closure")
    assert summary["reached"] + sum(summary[key] for key in ends) == 3
    for each in (one.reach for one in found if one.reach.reached):
        assert each.certificate.verify()
        assert gc.force_closure(each.contacts, friction=found.friction).closed
        assert len(each.joints) == len(found.hand.joints) == 16
        assert len(set(found.finger_names(each))) == 4
        assert each.used.tolist() == [0, 1, 2, 3]


PLAIN_FINGER = """
<body name="f{n}" pos="0 {y} 0">
  <joint name="a{n}" axis="0 1 0" range="-1.5 1.5"/>
  <geom type="box" size="0.006 0.006 0.02" pos="0 0 0.02"/>
  <body name="g{n}" pos="0 0 0.04">
    <joint name="b{n}" axis="0 1 0" range="-1.5 1.5"/>
    <geom type="box" size="0.006 0.006 0.015" pos="0 0 0.015"/>
    <geom name="tip{n}" type="sphere" size="0.008" pos="0 0 0.03"/>
  </body>
</body>"""


def test_a_grasp_that_is_not_reached_is_a_negative_answer(bracket_plan, tmp_path, answer):
    """A hand whose fingers all bend the same way cannot enclose anything."""
    path = tmp_path / "plain.xml"
    fingers = "".join(PLAIN_FINGER.format(n=n, y=0.04 * n) for n in range(4))
    path.write_text(
        '<mujoco><compiler angle="radian"/><worldbody><body name="palm">'
        f'<geom type="box" size="0.02 0.08 0.01" pos="0 0.06 -0.02"/>{fingers}</body></worldbody>'
        "</mujoco>"
    )
    tips = ",".join(f"tip{n}" for n in range(4))
    asked = ["--hand", path, "--fingertips", tips, "--limit", "1", "--starts", "5"]
    (only,) = answer("reach", bracket_plan, *asked, code=Exit.NEGATIVE)["reaches"]
    assert only["joints_rad"] is None
    assert "no pose was found" in only["explanation"]
    assert only["nearest"]["gaps_m"]
    out = tmp_path / "out"
    assert main(["reach", str(bracket_plan), *map(str, asked), "--out", str(out)]) == Exit.NEGATIVE
    picture = out / NEAREST_PICTURE
    assert "with the hand plain where it came nearest" in picture.read_text()
    shutil.copy(bracket_plan, out / "grasps.json")
    shown = tmp_path / "shown.svg"
    words = ["view", str(out), "--grasp", only["id"], "--picture", str(shown)]
    assert main(words) == Exit.GOOD
    assert shown.read_text() == picture.read_text()
    assert main(["report", str(out), "-q"]) == Exit.GOOD
    page = (out / "report" / "grasps" / f"{only['id']}.html").read_text()
    assert f"pictures/{only['id']}-nearest.svg" in page
    assert main(["reach", str(bracket_plan), "--limit", "1", "--out", str(out)]) == Exit.GOOD
    assert not picture.exists()


def test_what_cannot_be_reached_or_simulated_is_refused(bracket_plan, capsys):
    for flags, *said in (
        (["--hand", "nose"], "built-in hands are allegro, allegro-urdf, leap"),
        (["--simulate"], "give one for all joints with --torque-limit-n-m"),
        (["--mass-kg", "0.1"], "--mass-kg needs a torque limit for each joint"),
    ):
        assert main(["reach", str(bracket_plan), *flags]) == Exit.INPUT
        found = capsys.readouterr().err
        assert all(words in found for words in said)


def test_a_hand_holds_and_executes_the_grasps_that_it_reaches(bracket_plan, tmp_path, capsys):
    shutil.copy(bracket_plan, tmp_path / "grasps.json")
    words = ["reach", str(tmp_path / "grasps.json"), "--hand", "allegro", "--limit", "1"]
    words += ["--simulate", "--mass-kg", "0.05", "--torque-limit-n-m", "0.5"]
    code = main([*words, "--out", str(tmp_path)])
    said = capsys.readouterr().out
    found = Reaches.read(tmp_path / REACHES)
    assert found.complete
    assert found.text() == (tmp_path / REACHES).read_text()
    (each,) = found
    assert each.reach.reached, said
    held, executed, execution = each.simulated, each.executed, each.executed.execution
    assert held.held
    assert len(held.wrenches) == 13
    assert len(held.controls) >= 3
    assert held.controls_let_go
    assert held.weakest_n > 0.1
    assert "1 of 1 hands held all wrenches" in said
    assert each.id in said[said.index("with its motors") :]
    assert execution.mass_kg == found.execution.mass_kg == 0.05
    assert found.execution.knock_n_s == pytest.approx(0.05 / 6.0)
    assert len(execution.trials) >= 20
    assert executed.controls_let_go
    assert execution.payload_kg > 0.05
    assert execution.tip_radius_m.tolist() == [0.012] * len(execution.squeeze)
    assert (executed.enough is None) == executed.survived
    assert code == (Exit.GOOD if executed.survived else Exit.NEGATIVE)
    assert f"{executed.survived:d} of 1 grasps survived every trial with the hand" in said
    assert main(["report", str(tmp_path), "-q"]) == Exit.GOOD
    page = (tmp_path / "report" / "grasps" / f"{each.id}.html").read_text()
    assert "With its motors: weakest wrench N" in page
    assert "at 80 % of what contacts and motors resist" in page
    assert "Executed with the hand: survived" in page
    first = (tmp_path / "report" / "index.html").read_text()
    assert '<option value="-hand">hand resists most</option>' in first
    assert f'data-hand="{held.weakest_n}"' in first
    kept = sum(trial.survived for trial in executed.trials)
    assert f"survived {kept} of {len(executed.trials)} trials" in first


def test_a_hand_of_known_motors_and_links_says_what_it_carries(bracket_plan, tmp_path, capsys):
    words = ["reach", str(bracket_plan), "--hand", "leap", "--limit", "1", "--jobs", "1"]
    main([*words, "--out", str(tmp_path)])
    said = capsys.readouterr().out
    assert "payload kg: Largest mass that the motors hold whichever way" in said
    (each,) = Reaches.read(tmp_path / REACHES)
    found = each.payload
    assert 0.0 < found.lower_kg <= found.upper_kg <= 1.002 * found.lower_kg
    assert f"{found.lower_kg:.3g}" in said


def test_a_hand_too_weak_for_an_object_says_so(bracket_plan, tmp_path, capsys):
    words = ["reach", str(bracket_plan), "--hand", "leap", "--limit", "1", "--mass-kg", "5"]
    code = main([*words, "--torque-limit-n-m", "0.01", "--out", str(tmp_path)])
    assert code == Exit.NEGATIVE
    (one,) = Reaches.read(tmp_path / REACHES)
    assert one.reach.reached
    assert one.executed.execution is None
    assert "cannot carry its own links" in one.executed.reason
    assert one.too_weak == one.executed.reason
    assert "not tried" in capsys.readouterr().err


def test_motors_too_weak_for_their_links_are_counted(bracket_plan, tmp_path, capsys):
    words = ["reach", str(bracket_plan), "--hand", "leap", "--limit", "1", "--jobs", "1"]
    main([*words, "--torque-limit-n-m", "0.01", "--out", str(tmp_path)])
    said = capsys.readouterr()
    found = Reaches.read(tmp_path / REACHES)
    (one,) = found
    assert one.payload is None
    assert "the hand cannot carry its own links there" in one.too_weak
    assert found.summary["torque"] == found.summary["reached"] == 1
    assert "in 1 of those reached, the motors are too weak" in said.out
    assert f"{one.id}: torque: {one.too_weak}" in said.err
