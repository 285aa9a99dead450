"""The commands that show: a grasp in a viewer or in files, and what the machine can show."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import scenes
from scenes.drawing import clips
from sim_validate.commands.exit_codes import Exit
from sim_validate.main import main
from sim_validate.report import command as view_command
from sim_validate.report.command import COMING, closing
from tests.scenes.drawing.whole import frames_of
from tests.sim_validate.rigs import grasps


@pytest.fixture(autouse=True)
def nowhere(monkeypatch):
    """A machine without a display."""
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys, "platform", "linux")


def test_files_are_written_and_listed(wedge_plan, tmp_path, answer):
    picture, page = tmp_path / "new" / "a.svg", tmp_path / "new" / "a.html"
    shown = answer("view", wedge_plan, "--picture", picture, "--page", page)
    first = json.loads(wedge_plan.read_text())["grasps"][0]["id"]
    assert shown == {"id": first, "files": [str(picture), str(page)]}
    assert picture.read_text().startswith("<svg ")
    assert f"<h1>{first}</h1>" in page.read_text()


def test_without_a_display_files_are_offered(wedge_plan, capsys):
    assert main(["view", str(wedge_plan)]) == Exit.INPUT
    said = capsys.readouterr().err
    assert "no display" in said
    assert all(flag in said for flag in ("--picture", "--page", "--clip"))


def test_with_a_display_the_viewer_is_opened(wedge_plan, monkeypatch):
    opened = []

    def run(command, cwd, **_):
        assert Path(cwd) == Path(command[-1].partition("=")[2]).parent  # where its log is left
        path = command[-1].partition("=")[2]
        with open(path, encoding="utf-8") as scene:  # noqa: PTH123 - while it is there
            opened.append((command[1:4], scene.read()))
        return subprocess.CompletedProcess(command, len(opened) - 1)

    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(view_command.subprocess, "run", run)
    second = json.loads(wedge_plan.read_text())["grasps"][1]["id"]
    assert main(["view", str(wedge_plan), "--grasp", second, "--friction", "0.7"]) == Exit.GOOD
    ((module, text),) = opened
    assert module == ["-P", "-m", "mujoco.viewer"]
    assert '0.7 0.0 0.0"' in text
    assert main(["view", str(wedge_plan)]) == Exit.INPUT  # the viewer ends with 1


def test_the_viewer_runs_no_modules_of_the_working_folder(wedge_plan, tmp_path, monkeypatch):
    """The display is none that answers, so that the viewer ends at once."""
    for name in ("mujoco", "numpy"):
        (tmp_path / f"{name}.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w').close()")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("DISPLAY", ":64999")
    assert main(["view", str(wedge_plan)]) == Exit.INPUT
    assert not (tmp_path / "ran").exists()


def test_what_cannot_be_shown_is_refused(wedge_plan, here, capsys):
    for flag, name, said in (("--clip", "a.mp4", ""), ("--page", "a.png", " .html or .htm")):
        asked = ["view", str(wedge_plan), "--picture", "a.png", flag, name]
        assert main(asked) == Exit.USAGE
        assert f"{flag} must be a path that ends in{said}" in capsys.readouterr().err
    assert not list(here.iterdir())


def test_fingers_come_in_along_their_ways_and_stay():
    body, (grasp,) = grasps("wedge", 0.5, 1)
    scene = scenes.build_scene(body, grasp, 0.5)
    joints = closing(scene)
    frames = scene.layout.frames
    slides = np.einsum("kij,nkj->nki", frames, joints[:, 7:].reshape(len(joints), 4, 3))
    np.testing.assert_allclose(slides[0], scene.layout.approach, atol=1e-12)
    np.testing.assert_array_equal(slides[COMING - 1 :], 0.0)
    lengths = np.linalg.norm(slides[:COMING], axis=2)
    assert (np.diff(lengths, axis=0) < 0.0).all()
    np.testing.assert_array_equal(joints[:, :7], np.tile([0, 0, 0, 1, 0, 0, 0], (len(joints), 1)))


def test_without_graphics_there_is_no_clip_and_the_remedy_is_said(
    wedge_plan, tmp_path, monkeypatch, capsys
):
    monkeypatch.setenv("MUJOCO_GL", "no-such-library")
    asked = ["view", str(wedge_plan), "--page", str(tmp_path / "a.html")]
    assert main([*asked, "--clip", str(tmp_path / "a.gif")]) == Exit.INPUT
    assert "unset MUJOCO_GL" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["a.html"]


@pytest.mark.slow
def test_with_graphics_fingers_are_seen_closing(wedge_plan, tmp_path):
    try:
        clips.available_graphics()
    except clips.GraphicsError as error:
        pytest.skip(str(error))
    path = tmp_path / "a.webp"
    assert main(["view", str(wedge_plan), "--clip", str(path), "-q"]) == Exit.GOOD
    _, *frames = frames_of(path, 0, COMING)
    red = [(frame[..., 0] > frame[..., 1] + 60).sum() for frame in frames]
    assert min(red) > 200  # fingertips
    assert (np.abs(frames[0] - frames[1]).max(axis=2) > 30).mean() > 0.02


def test_doctor_says_what_there_is_and_what_to_do(monkeypatch, capsys):
    def none():
        raise clips.GraphicsError("egl: no such library")

    monkeypatch.setattr("sim_validate.doctor.available_graphics", none)
    assert main(["doctor", "--json"]) == Exit.GOOD
    shown = capsys.readouterr()
    document = json.loads(shown.out)
    assert all(document["checks"].values())
    assert document["gate"]["passed"]
    assert "egl: no such library" in document["machine"]["graphics"]
    assert "install libegl1" in document["machine"]["graphics"]
    assert document["machine"]["display for the viewer"].startswith("no")
    for word in ("compiled loops", "must be", "all checks passed"):
        assert word in shown.err


def test_doctor_names_what_failed(monkeypatch, capsys):
    monkeypatch.setattr("sim_validate.doctor.critical_friction", lambda _: 0.1)
    assert main(["doctor"]) == Exit.INTERNAL
    shown = capsys.readouterr()
    assert "FAILED critical friction" in " ".join(shown.out.split())
    assert "reinstall the package" in shown.err


def test_reports_need_no_tables_of_datasets():
    """They take a tenth of a second to declare."""
    program = (
        "import sys, sim_validate.report.command\nprint('sim_validate.datasets' in sys.modules)"
    )
    ran = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert ran.stdout == "False\n"
