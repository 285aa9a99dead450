"""Reports show what executions found; the executions here are written by hand."""

import math
import re
import shlex
import shutil
from dataclasses import asdict, replace

import pytest

import sim_validate as sv
from grasp_core.closure.contacts import contacts_sha256
from grasp_core.errors import InputError
from grasp_core.execution.loads import GRAVITY_M_PER_S2
from grasp_core.planning.grasps_json import load_grasps
from scenes.mujoco_options import PhysicsSettings
from sim_validate.commands.exit_codes import Exit
from sim_validate.engine.held_or_let_go import Outcome
from sim_validate.execution.command import execution_settings
from sim_validate.execution.verdict import (
    ExecutedGrasp,
    ExecutionControl,
    Executions,
    Skipped,
    load_executions,
)
from sim_validate.files.result_files import AboutObject
from sim_validate.main import main
from sim_validate.report import cards
from sim_validate.report.report import write_report
from sim_validate.report.run_folder import runs_in, said_of_both
from sim_validate.report.sections import execute_command
from sim_validate.settings import ExecutionSettings
from tests.sim_validate.changing import at, changed, slipped
from tests.sim_validate.execution.executed import execution, trial
from tests.sim_validate.report.test_report import EVIL, Page

SETTINGS = ExecutionSettings(0.3, shake_g=0.5, stop_m_per_s2=2.0 * GRAVITY_M_PER_S2,
                             stop_from_m_per_s=1.0, knock_n_s=0.02)  # fmt: skip


def seen(kind, name, predicted, simulated, **ended):
    return trial(
        kind, name, slip_m=1.25e-3, displacement_m=2.5e-3, turn_rad=math.radians(3.5),
        predicted_first_slip=predicted, predicted_loss=1.25 * predicted,
        simulated_first_slip=simulated, **ended,
    )  # fmt: skip


TRIALS = (
    seen("weight", "weight", math.inf, math.inf),
    seen("shake", "shake along x", 1.31, 1.32),
    seen("shake", "shake about x", 0.72, 0.73, fate="slipped"),
    seen("stop", "stop +x", 0.91, 0.92, survived=False, fate="dropped"),
)
KEPT = tuple(replace(each, survived=True, fate="stuck") for each in TRIALS)
SKIPPED = (Skipped("lift", "a fingertip is in the way"),)
CONTROL = ExecutionControl("friction 0.9", True, 0.96)


def carrying(multiple, trials, control=CONTROL, skipped=()):
    return execution(*trials, load_multiple=multiple, controls=(control,), skipped=skipped)


def executed(saved, found):
    return tuple(
        ExecutedGrasp(grasp.id, grasp.family, contacts_sha256(grasp.contacts), each,
                      None if each else "no squeeze survives the loads")
        for grasp, each in zip(saved.grasps, found, strict=True)
    )  # fmt: skip


def results(saved, found, complete=True):
    return Executions(AboutObject.of(saved.body), 0.4, SETTINGS, found, complete=complete)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A folder with three grasps: one loses the object, one survives, one has no squeeze."""
    folder = tmp_path_factory.mktemp("executed")
    assert main(["plan", "wedge", "--limit", "3", "--out", str(folder), "-q"]) == Exit.GOOD
    saved = load_grasps(folder / "grasps.json")
    found = executed(saved, [carrying(2.5, TRIALS, skipped=SKIPPED), carrying(3.5, KEPT), None])
    (folder / "executions.json").write_text(results(saved, found).text())
    return folder


@pytest.fixture(scope="module")
def report(run):
    return write_report(run, run.parent / "report of executions", jobs=1).index.parent


@pytest.fixture
def copy(run, tmp_path):
    return shutil.copytree(run, tmp_path / "copy")


def cells_of(page, heading):
    """The texts of a table's row that begins with a heading."""
    row = page[page.index(heading) :]
    return [text for text in Page(row[: row.index("</tr>")]).said if text.strip()][1:]


def test_the_first_page_has_a_row_for_each_grasp(run, report):
    text = (report / "index.html").read_text()
    table = text[text.index('id="executions"') :]
    names = [grasp.id for grasp in load_grasps(run / "grasps.json").grasps]
    assert cells_of(table, f"{names[0]}</a></th>")[-9:] == [
        "failed 1 of 4 trials", "2.5", "0.75", "0.72", "0.73", "2.5", "1", "no", "0.90",
    ]  # fmt: skip
    assert cells_of(table, f"{names[1]}</a></th>")[-9:] == [
        "survived", "3.5", "1.05", "0.72", "0.73", "2.5", "0", "yes", "0.90",
    ]  # fmt: skip
    assert cells_of(table, f"{names[2]}</a></th>")[-9:] == [
        "no squeeze", *6 * ["-"], "no", "0.00",
    ]  # fmt: skip
    assert re.findall(r'data-loss="([^"]*)"', text) == ["0.9", "0.9", "0"]
    assert '<option value="-loss">' in text
    said = " ".join(Page(text).said)
    assert "1 of 3 grasps survived every trial with 0.3 kg at friction 0.4; 7 of 8 trials" in said
    assert "no squeeze holds the object in 1 of them." in said
    assert f"Best for this: {names[1]}, predicted to be lost at 0.90 times" in said
    assert "It is the number to choose by" in said
    assert "its squeeze carries 1.05 kg in any direction." in said
    for name in names:
        assert f"grasps/{name}.html#executed" in text


def test_a_grasp_is_bad_if_its_closure_or_its_execution_is(run):
    found, saved = load_executions(run / "executions.json"), load_grasps(run / "grasps.json")
    quick = sv.Agenda(controls=False, critical_friction=False)
    held = sv.validate(saved.body, saved.grasps[0], saved.friction, agenda=quick)
    lost = slipped(replace(held, wrenches=(replace(held.wrenches[0], predicted_limit=0.5),)))
    for closure, verdict, one, said, tone in (
        ("held", held, found[0], "lost", "bad"), ("held", held, found[1], "survived", "good"),
        ("slipped", lost, found[1], "survived", "bad"),
        ("held", held, None, "not executed", "good"),
    ):  # fmt: skip
        assert said_of_both(verdict, found, one) == (f"closure: {closure}; execution: {said}", tone)
        assert said_of_both(verdict, None, None)[0] == closure
    first = held.wrenches[0]
    late = replace(first, hold=replace(first.hold, outcome=Outcome.TIMEOUT))
    assert said_of_both(replace(held, wrenches=(late,)), None, None) == ("timeout", "bad")


def test_the_page_of_a_grasp_has_all_of_its_execution(run, report):
    lost, kept, none = (
        (report / "grasps" / f"{grasp.id}.html").read_text()
        for grasp in load_grasps(run / "grasps.json").grasps
    )
    assert cells_of(lost, ">stop +x<")[-8:] == [
        "no", "dropped", "1.25", "2.5", "3.5", "0.91", "1.14", "0.92",
    ]  # fmt: skip
    assert cells_of(lost, ">weight<")[-3:] == ["never", "never", "never"]
    assert cells_of(lost, ">friction 0.9<")[-2:] == ["yes", "0.96"]
    said = " ".join(Page(lost).said)
    for part in ("at friction 0.4", "at most 10 N", "2000 N/m", "fingertips of 50 g",
                 "Trials that the object did not survive", "Multiple of the object's weight",
                 "No lift: a fingertip is in the way."):  # fmt: skip
        assert part in said
    assert "No lift" not in kept
    assert "No squeeze: no squeeze survives the loads." in " ".join(Page(none).said)
    assert all("magnified" not in page for page in (lost, kept, none))


def test_grasps_that_were_lost_are_drawn_first(run):
    """The second grasp is the only one that survives."""
    (folder,) = runs_in(run)
    ids = [grasp.id for grasp in folder.saved.grasps]
    assert [found.alarming for found in folder] == [True, False, True]
    assert [grasp.id for grasp in folder.first(2).saved.grasps] == [ids[0], ids[2]]


@pytest.mark.usefixtures("no_pictures")
def test_a_control_that_held_is_bad_news(copy, tmp_path):
    saved = load_grasps(copy / "grasps.json")
    held = replace(CONTROL, let_go=False, first_slip=math.inf)
    found = executed(saved, [carrying(2.5, KEPT, held), carrying(3.5, KEPT), None])
    (copy / "executions.json").write_text(results(saved, found, complete=False).text())
    said = Page(write_report(copy, tmp_path / "out", jobs=1, limit=1).index.read_text()).said
    assert said.count("a negative control held") == 2
    assert "The executions were interrupted." in " ".join(said)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (at("object", content_sha256="0"), "another object than grasps.json"),
        (at("executions", 0, contacts_sha256="0"), "contacts of .* differ"),
    ],
)  # fmt: skip
def test_files_of_other_runs_are_refused(copy, change, says):
    changed(copy / "executions.json", change)
    with pytest.raises(InputError, match=f"executions.json: .*{says}"):
        write_report(copy, jobs=1)
    assert not (copy / "report").exists()


@pytest.mark.usefixtures("no_pictures")
def test_names_and_reasons_are_escaped(copy, tmp_path):
    def spoiled(document):
        first = document["executions"][0]
        first["trials"][0]["name"] = first["skipped"][0]["reason"] = EVIL
        document["executions"][2]["reason"] = EVIL

    changed(copy / "executions.json", spoiled)
    report = write_report(copy, tmp_path / "out", jobs=1, limit=2).index.parent
    pages = [path.read_text() for path in (report / "grasps").iterdir()]
    assert len(pages) == 2
    assert all("<script>document" not in page for page in pages)
    assert all(EVIL.replace("\x1b", " ") in "".join(Page(page).said) for page in pages)


def test_clips_that_were_made_are_shown(copy, tmp_path, monkeypatch):
    finer = PhysicsSettings(timestep=0.001)
    changed(copy / "executions.json", at("executions", 0, physics=asdict(finer)))

    def film(job, name, path):
        assert (job.friction, job.settings, job.physics["timestep"]) == (0.4, SETTINGS, 0.001)
        path.parent.mkdir(exist_ok=True)
        path.write_text(name)

    monkeypatch.setattr(cards, "film", film)
    report = write_report(copy, tmp_path / "out", jobs=1, limit=1, clips=1).index.parent
    clips = {path.name: path.read_text() for path in (report / "clips").iterdir()}
    first = load_grasps(copy / "grasps.json").grasps[0].id
    assert clips == {
        f"{first}-executed-0.webp": "shake about x", f"{first}-executed-1.webp": "stop +x",
    }  # fmt: skip
    page = Page((report / "grasps" / f"{first}.html").read_text())
    assert {f"../clips/{name}" for name in clips} <= set(page.links)
    assert "it is not magnified" in " ".join(page.said)
    assert "stop +x: dropped" in page.said


@pytest.mark.parametrize(
    "settings",
    [
        SETTINGS,
        ExecutionSettings(
            mass_kg=0.1, push_n=7.5, tip_stiffness_n_per_m=950.0, tip_radius_m=0.004,
            tip_mass_kg=0.02, damping_ratio=0.7, down=(0.1, -0.25, -1e-3),
            trials=("weight", "misplaced"), lift_m=0.1, lift_s=0.4, shake_g=2.0, shake_hz=7.0,
            stop_m_per_s2=9.0, stop_from_m_per_s=0.4, knock_n_s=0.01, off_mm=1.5, off_deg=3.0,
            misplacements=4, seed=17, max_mm=6.0, max_deg=7.0,
        ),
    ],
)  # fmt: skip
def test_the_command_executes_a_grasp_with_the_same_settings(run, settings, asked):
    executions = Executions(AboutObject("", "", ""), 0.35, settings, (), complete=True)
    line = execute_command(executions, str(run / "grasps.json"), "c-0-1-2-7")
    assert main(shlex.split(line)[1:]) == Exit.GOOD
    (flags,) = asked
    assert (flags.friction, flags.grasp) == (0.35, "c-0-1-2-7")
    of = load_grasps(flags.grasps)
    assert execution_settings(flags.executing, of.body, flags.seed, of.finger) == settings
