import json
import os
import re
import shlex
import signal
import subprocess
import sys
from pathlib import Path
from typing import get_args

import pytest
import trimesh

from grasp_core.mesh_files.limits import MESH_FORMATS
from grasp_core.names import HANDS, RANKINGS, RankBy
from grasp_core.planning.result import FAMILIES
from grasp_core.provenance import versions
from scenes.drawing.painting import Camera
from scenes.drawing.pictures import AZIMUTH_DEG, OBJECT_ELEVATION_DEG
from scenes.example_objects import example_object
from sim_validate.commands.exit_codes import Exit
from sim_validate.commands.flags import CLIP_TYPES, PAGE_TYPES, PICTURE_TYPES
from sim_validate.commands.simulation_flags import WRITTEN_ENDINGS
from sim_validate.commands.table import EXAMPLES, GROUPS
from sim_validate.engine.held_or_let_go import HoldVerdict, Outcome
from sim_validate.main import main
from sim_validate.processes import workers
from sim_validate.protocols.published import PROTOCOLS
from sim_validate.settings import ProtocolName
from tests.grasp_core.curved import bumpy_ellipsoid
from tests.patience import HANGING_S

pytestmark = pytest.mark.usefixtures("here")
ROOT = Path(__file__).parent.parent.parent
WORDS = {" ".join(line.split()[: 2 if line.split()[0] in GROUPS else 1]) for line in EXAMPLES}


def test_run_writes_grasps_verdicts_and_scenes_tells_and_removes_those_of_before(here, capsys):
    assert main(["run", "tetrahedron", "--families", "concurrent", "--out", "results"]) == Exit.GOOD
    assert sorted(p.name for p in here.iterdir()) == ["results"]
    names = sorted(p.name for p in (here / "results").iterdir())
    assert names == ["grasps.json", "report", "scenes", "verdicts.json"]
    assert [p.name for p in (here / "results" / "scenes").iterdir()] == ["c-0-1-2-3.xml"]
    assert (here / "results" / "report" / "grasps" / "c-0-1-2-3.html").is_file()
    shown = capsys.readouterr().out
    for word in ("concurrent", "in sim", "mu*", "held", "um moved", "results/report/index.html"):
        assert word in shown
    verdicts = json.loads((here / "results" / "verdicts.json").read_text())
    assert verdicts["complete"] is True
    assert verdicts["summary"]["grasps_held"] == verdicts["summary"]["grasps"] == 1
    assert verdicts["summary"]["controls"] > 0
    assert verdicts["summary"]["controls_held"] == 0
    # a second run leaves nothing of the first one behind
    kept = here / "results" / "scenes" / "mine.xml"
    kept.write_text("<mujoco/>")
    nothing = ["--cones", "normal", "--families", "concurrent", "--out", "results", "-q"]
    assert main(["run", "box", *nothing]) == Exit.NONE
    names = sorted(p.name for p in (here / "results").rglob("*") if p.is_file())
    assert names == ["grasps.json", "mine.xml"]
    assert not (here / "results" / "report").exists()


def test_one_and_two_processes_give_the_same_verdicts(here, monkeypatch):
    """To the last digit: whatever is simulated was planned with digits that solvers agree on."""
    monkeypatch.setattr(workers, "UNITS_PER_PROCESS", 2)
    assert main(["plan", "tetrahedron", "--limit", "4", "--out", "p", "-q"]) == Exit.GOOD
    for jobs in ("1", "2"):
        command = ["validate", "p/grasps.json", "--jobs", jobs, "--out", jobs, "-q"]
        assert main(command) == Exit.GOOD
    one, two = ((here / jobs / "verdicts.json").read_text() for jobs in ("1", "2"))
    assert one == two


def test_json_output_is_one_document_and_the_rest_goes_elsewhere(here, answer):
    commands = {
        "objects": 0, "run wedge --limit 1 --no-report": 0, "report graspproof-out/wedge": 0,
        "scene graspproof-out/wedge/grasps.json --out s": 0,
        "plan box --families pencil --cones normal --out b": 5, "validate b/grasps.json": 5,
    }  # fmt: skip
    for command, code in commands.items():
        answer(*command.split(), code=code)
    assert (here / "graspproof-out" / "wedge" / "report" / "index.html").exists()


@pytest.mark.parametrize(("command", "name"), [("run", "box"), ("plan", "prism")])
def test_an_object_without_grasps_says_so_in_one_sentence(capsys, command, name):
    paper = ["--families", ",".join(FAMILIES)]
    assert main([command, name, "--cones", "normal", *paper]) == Exit.NONE
    sentences = [
        line for line in capsys.readouterr().out.splitlines() if "positively spanning" in line
    ]
    assert len(sentences) == 1


def test_a_scale_multiplies_what_a_mesh_file_says(here, answer, capsys):
    body, said = example_object("wedge"), []
    for name, size in (("part.obj", 1e3), ("double.obj", 2e3)):
        trimesh.Trimesh(size * body.vertices, body.triangles).export(here / name)
    for name, scale in (("part.obj", "1"), ("double.obj", "0.5")):
        said.append(answer("inspect", name, "--unit", "mm", "--scale", scale))
    assert said[0].pop("name") != said[1].pop("name")
    assert said[0] == said[1]
    assert said[0]["radius_m"] == pytest.approx(body.radius)
    assert main(["inspect", "double.obj"]) == Exit.INPUT
    assert "--scale" in capsys.readouterr().err
    for refused in ("0", "-1", "inf", "nan", "half"):
        assert main(["inspect", "double.obj", "--scale", refused]) == Exit.USAGE
        assert "--scale" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["plan", "tetrahedon"], Exit.INPUT, "did you mean tetrahedron"),
        (["plan", "wedge", "--theta-deg", "40"], Exit.INPUT, "theta_deg must be a number from"),
        (["plan", "wedge", "--friction", "0"], Exit.USAGE, "friction"),
        (["plan", "wedge", "--fricton", "0.3"], Exit.USAGE, "--friction"),
        (["plna", "wedge"], Exit.USAGE, "no command 'plna'; did you mean plan"),
        (["validte"], Exit.USAGE, "did you mean validate"),
        (["prism"], Exit.USAGE, "the commands are run, plan, validate"),
        (["dataset", "biuld"], Exit.USAGE, "no command 'dataset biuld'; did you mean build"),
        (["baseline", "check-it"], Exit.USAGE, "did you mean check"),
        (["dataset", "wedge"], Exit.USAGE, "the commands are build, import, verify"),
        (["plan"], Exit.USAGE, "Required options"),
        (["plan", "wedge", "--config"], Exit.USAGE, "--config"),
        (["plan", "box", "--ceiling", "10"], Exit.INPUT, "--ceiling needs --optimize"),
        (["plan", "box", "--approach-m", "0.1"], Exit.INPUT, "also needs --finger-radius-m"),
        (["plan", "box", "--complete", "--families", "pencil"], Exit.INPUT, "the free method"),
        (["plan", "box", "--optimize", "--share-faces-m", "0.01"], Exit.INPUT, "leave out --opt"),
        (["plan", "box", "--scale", "2"], Exit.INPUT, "leave out --unit, --scale"),
    ],
)  # fmt: skip
def test_errors_have_their_exit_code_and_name_the_cause(here, capsys, arguments, code, words):
    assert main(arguments) == code
    complaint = capsys.readouterr()
    assert words in complaint.err + complaint.out
    assert "Traceback" not in complaint.err
    assert not list(here.iterdir())


def test_a_config_file_sets_flags_and_flags_override_it(here, answer, capsys):
    (here / "c.toml").write_text('friction = 0.3\nlimit = 2\nfamilies = ["concurrent"]\n')
    plan = answer("plan", "wedge", "--config", "c.toml")
    assert (plan["friction"], len(plan["grasps"])) == (0.3, 2)
    assert len(answer("plan", "wedge", "--config=c.toml", "--limit", "1")["grasps"]) == 1
    body = example_object("wedge")
    trimesh.Trimesh(body.vertices, body.triangles).export(here / "wedge.stl")
    (here / "c.toml").write_text("center_of_mass_m = [0.001, 0.0, -0.002]\njson = true\n")
    assert main(["inspect", "wedge.stl", "--unit", "m", "--config", "c.toml"]) == Exit.GOOD
    assert json.loads(capsys.readouterr().out)["center_of_mass_m"] == [0.001, 0.0, -0.002]
    for text, said in (
        ("[friction]\nlimit = 1\n", "'friction.limit': unknown flag"),
        ("frictn = 0.3\n", "'frictn': unknown flag; did you mean friction?"),
        ("[patches]\nmost = 3\n", "--patches.most must be a whole number from 4 up to 200"),
    ):
        (here / "bad.toml").write_text(text)
        assert main(["plan", "wedge.stl", "--config", "bad.toml"]) == Exit.USAGE
        assert said in capsys.readouterr().err


def test_a_control_that_holds_makes_the_run_fail(monkeypatch, capsys):
    def always_held(trace, *_):
        return HoldVerdict(Outcome.HELD, "", 0.0, 0.0, 0.0, trace.slips_m.max(axis=0), None)

    monkeypatch.setattr("sim_validate.closure.controls.judge", always_held)
    assert main(["run", "wedge", "--limit", "1", "--jobs", "1", "--no-report"]) == Exit.NEGATIVE
    assert "negative controls were let go (all should)" in capsys.readouterr().out


def test_a_run_without_controls_says_so(monkeypatch, capsys):
    monkeypatch.setattr("sim_validate.closure.validate.negative_controls", lambda *_: ())
    assert main(["run", "tetrahedron", "--jobs", "1", "--no-report"]) == Exit.GOOD
    assert "no negative controls" in capsys.readouterr().err


def test_an_unexpected_error_is_internal_and_shows_its_place_when_asked(monkeypatch, capsys):
    def broken(*_, **__):
        raise RuntimeError("boom")

    monkeypatch.setattr("sim_validate.planning.plan.search_grasps", broken)
    assert main(["plan", "wedge"]) == Exit.INTERNAL
    assert "internal error" in capsys.readouterr().err
    assert main(["plan", "wedge", "-v"]) == Exit.INTERNAL
    assert "boom" in capsys.readouterr().err


def test_control_characters_in_a_name_do_not_reach_the_terminal(here, capsys):
    body = example_object("box")
    trimesh.Trimesh(body.vertices, body.triangles).export(here / "a\x1b[31mb.stl")
    assert main(["inspect", "a\x1b[31mb.stl"]) == Exit.GOOD
    shown = capsys.readouterr()
    assert "\x1b[31m" not in shown.out + shown.err


@pytest.mark.slow
def test_graphics_that_are_not_here_are_named():
    code = "from sim_validate.main import run_and_exit; run_and_exit()"
    done = subprocess.run(
        [sys.executable, "-c", code, "doctor"], env=os.environ | {"MUJOCO_GL": "nonsense"},
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == Exit.INPUT
    assert "MUJOCO_GL" in done.stderr
    assert "internal error" not in done.stderr


@pytest.mark.slow
def test_an_interrupted_run_keeps_what_is_done(here):
    """SIGINT while simulating: exit code 130, a whole grasps.json, verdicts marked incomplete."""
    code = (
        "from sim_validate.commands import console; console.PLAIN_EVERY_S = 0.2;"
        "from sim_validate.main import run_and_exit; run_and_exit()"
    )
    command = [sys.executable, "-c", code, "run", "icosahedron", "--limit", "150"]
    command += ["--cones", "normal", "--families", "concurrent", "--jobs", "1"]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    process = subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True)
    folder = here / "graspproof-out" / "icosahedron"
    said = []
    for line in process.stderr:  # the first line of progress says that some are simulated
        said.append(line)
        if re.match(r"simulating [1-9]\d*/150", line):
            break
    process.send_signal(signal.SIGINT)
    _, complaint = process.communicate(timeout=HANGING_S)
    assert process.returncode == Exit.INTERRUPTED, [*said, complaint]
    assert len(json.loads((folder / "grasps.json").read_text())["grasps"]) == 150
    verdicts = json.loads((folder / "verdicts.json").read_text())
    assert verdicts["complete"] is False
    assert 0 < len(verdicts["verdicts"]) < 150


def test_a_scan_with_a_hole_is_planned_for_fingers_and_holds_on_its_true_surface(here, capsys):
    vertices, triangles = bumpy_ellipsoid(noise=0.001, subdivisions=3)
    trimesh.Trimesh(1e3 * vertices, triangles[5:], process=False).export(here / "scan.ply")
    flags = ["--unit", "mm", "--patches.most", "10", "--limit", "1", "--out", "r"]
    fingers = ["--finger-radius-m", "0.004", "--approach-m", "0.03"]
    assert main(["run", "scan.ply", *flags, *fingers, "--no-report"]) == Exit.GOOD
    shown = capsys.readouterr()
    assert "no finger is placed there" in shown.err
    assert "1 of 1 grasps held" in shown.out
    verdict = json.loads((here / "r" / "verdicts.json").read_text())["verdicts"][0]
    assert verdict["scale"]["fingers"]["radius_m"] == 0.004
    saved = json.loads((here / "r" / "grasps.json").read_text())
    assert saved["object"]["patches"] == {"spread_deg": 10.0, "depth": 0.01, "most": 10}
    assert saved["finger"] == {"radius_m": 0.004, "approach_m": 0.03}
    assert main(["validate", "r/grasps.json"]) == Exit.GOOD
    assert "no finger is placed there" in capsys.readouterr().err
    assert main(["inspect", "scan.ply", "--unit", "mm"]) == Exit.GOOD
    said = capsys.readouterr().out
    assert "Its surface is curved: fingers may stand on 20 nearly flat" in said
    assert "deg at most (10 deg allowed)" in said


def test_the_faces_of_a_mesh_are_listed_with_their_places(answer, capsys):
    facts, box = answer("inspect", "box"), example_object("box")
    assert facts["faces"] == len(facts["face_list"]) == 6
    for number, (listed, face) in enumerate(zip(facts["face_list"], box.faces, strict=True)):
        assert listed["number"] == number
        assert listed["normal"] == face.normal.tolist()
        assert listed["center_m"] == face.centroid.tolist()
        assert listed["area_m2"] == face.area
    assert facts["face_list"][3]["place"] == "facing +z at z = 25 mm"
    assert main(["inspect", "box"]) == Exit.GOOD
    said = capsys.readouterr().out
    (row,) = [line.split() for line in said.splitlines() if "facing +z" in line]
    assert row == ["3", "facing", "+z", "at", "z", "=", "25", "mm", "7000"]


def test_an_object_is_drawn(here, answer):
    assert answer("inspect", "wedge", "--picture", "wedge.svg")["picture"] == "wedge.svg"
    text = (here / "wedge.svg").read_text()
    assert text.startswith("<svg ")
    numbers = [int(each) for each in re.findall(r">(\d+)</text>", text)]
    assert text.count("<text") == len(numbers)
    view = Camera.of_angles(AZIMUTH_DEG, OBJECT_ELEVATION_DEG, wedge := example_object("wedge"))
    assert numbers == [
        number
        for number, face in enumerate(wedge.faces)
        if (view.camera - face.centroid) @ -face.normal > 0.0
    ]
    assert 3 <= len(numbers) < len(wedge.faces)


def test_planning_flags_reach_the_planner(capsys):
    flags = ["--friction", "0.3", "--complete", "--rank-by", "diverse", "--limit", "5"]
    assert main(["plan", "double-wedge-bar", *flags]) == Exit.GOOD
    assert "0 undecided, 0 left open" in capsys.readouterr().out
    reach = ["--finger-radius-m", "0.006", "--approach-m", "0.05", "--edge-clearance-m", "0.001"]
    assert main(["plan", "l-bracket", *reach, "--share-faces-m", "0.01", "--limit", "40"]) == 0
    assert "out of reach" in capsys.readouterr().out


def test_plans_ordered_by_what_grasps_carry_show_it(capsys):
    assert main(["plan", "tetrahedron", "--rank-by", "payload", "--limit", "3"]) == Exit.GOOD
    said = capsys.readouterr().out
    rows = re.findall(r"^ [cprf](?:-\d+){4} +([\d.]+) *$", said, re.MULTILINE)
    masses = list(map(float, rows))
    assert masses == sorted(masses, reverse=True)
    assert masses[0] == pytest.approx(1.26, abs=5e-3)


def test_a_file_of_results_is_no_object(capsys):
    Path("grasps.json").write_text("{}")
    for command in ("inspect", "plan", "run"):
        assert main([command, "grasps.json"]) == Exit.INPUT
        assert "validate` and `execute` read a grasps.json" in capsys.readouterr().err


@pytest.mark.parametrize("words", sorted(WORDS))
def test_help_on_a_command_shows_examples_that_can_be_typed(asked, capsys, words):
    assert main([*words.split(), "--help"]) == Exit.GOOD
    shown = capsys.readouterr().out.partition("\nexamples:\n")[2].splitlines()
    own = [f"  graspproof {line}" for line in EXAMPLES if f"{line} ".startswith(f"{words} ")]
    assert shown == own
    for line in shown:
        assert main(shlex.split(line)[1:]) == Exit.GOOD
    assert len(asked) == len(shown) > 0


@pytest.mark.parametrize(
    ("words", "flag", "values"),
    [
        ("plan", "--rank-by", get_args(RankBy)), ("run", "--rank-by", get_args(RankBy)),
        ("plan", "{ferrari-canny,weight,task}", ("Ferrari-Canny", "weight", "task")),
        ("plan", "STR", MESH_FORMATS),
        ("inspect", "--picture", PICTURE_TYPES), ("view", "--picture", PICTURE_TYPES),
        ("view", "--page", PAGE_TYPES), ("view", "--clip", CLIP_TYPES),
        ("transfer", "part,", MESH_FORMATS),
        ("hand", "STR", HANDS), ("reach", "--hand", HANDS), ("dataset build", "--hand", HANDS),
        ("export", "--to", WRITTEN_ENDINGS),
        ("export", "--out", [ends[0] for ends in WRITTEN_ENDINGS.values()]),
    ],
)  # fmt: skip
def test_the_help_of_a_flag_names_every_value(capsys, words, flag, values):
    assert main([*words.split(), "--help"]) == Exit.GOOD
    shown = capsys.readouterr().out.partition("examples:")[0].partition("positional")[2]
    said = " ".join(shown.replace("│", "").split())
    part = re.split(r"\((?:default|required)", said.split(f" {flag} ")[-1])[0]
    text = re.sub(r"\{[^}]*\}", "", part)
    for value in values:
        assert value in text


def test_every_ranking_is_described_wherever_rankings_are():
    assert set(RANKINGS) == set(get_args(RankBy))
    assert get_args(ProtocolName) == tuple(PROTOCOLS)


def test_the_version_is_that_of_graspproof_mujoco_and_python(capsys):
    assert main(["--version"]) == Exit.GOOD
    found = versions()
    said = f"graspproof {found['graspproof']}, MuJoCo {found['mujoco']}, Python {found['python']}\n"
    assert capsys.readouterr().out == said


@pytest.mark.parametrize(
    "words", ["plan wedge", "regions p/grasps.json --max-cones 64", "transfer p/grasps.json wedge"]
)
def test_a_quiet_command_without_a_folder_says_that_nothing_is_written(capsys, words):
    assert main(["plan", "wedge", "--limit", "1", "--out", "p", "-q"]) == Exit.GOOD
    assert capsys.readouterr() == ("", "")
    main([*words.split(), "-q"])
    assert capsys.readouterr().err.startswith("nothing will be written: with -q and without --out")
    main([*words.split(), "-q", "--json"])
    assert "written" not in capsys.readouterr().err


@pytest.mark.parametrize("command", ["plan wedge --limit 1", "run wedge --limit 1 --no-report"])
def test_it_is_said_that_the_room_for_fingers_is_not_checked_unless_it_is(capsys, command):
    for flags, unchecked in (("", True), ("--finger-radius-m 0.004 --approach-m 0.03", False)):
        main([*command.split(), *flags.split()])
        said = " ".join(capsys.readouterr().out.split())
        assert ("not checked: whether fingers have room" in said) == unchecked
        assert ("--finger-radius-m and --approach-m" in said) == unchecked


def test_loops_that_cannot_be_kept_are_told_once_with_what_helps(monkeypatch, capsys):
    monkeypatch.setattr("grasp_core.compiled.folders", lambda _: [Path("/dev/null/cache")])
    assert main(["plan", "wedge", "--limit", "1", "--jobs", "2"]) == Exit.GOOD
    said = " ".join(capsys.readouterr().err.split())
    assert said.count("compiled loops cannot be kept") == 1
    assert "/dev/null/cache: Not a directory" in said
    assert "NUMBA_CACHE_DIR" in said
    assert main(["objects"]) == Exit.GOOD
    assert not capsys.readouterr().err
