"""A part that was changed after its grasps were planned does not pass unseen."""

import json

import pytest

import grasp_core as gc
from grasp_core.files.text_files import write_text
from grasp_core.records.grasps_json import grasps_from_json, plan_to_json
from scenes.example_objects import example_object
from sim_validate.baselines.grasp_cases import grasp_cases
from sim_validate.baselines.source_file import ChangedPartError, Source, source_of
from sim_validate.baselines.suite_toml import suite_from_toml
from sim_validate.cli.exit_codes import Exit
from sim_validate.main import main
from tests.bad_input.mesh_texts import obj
from tests.sim_validate.plugin.project import copied, run_pytest


@pytest.fixture(scope="module")
def parted(tmp_path_factory):
    """A part, grasps planned on it in millimetres, and their baseline."""
    folder = tmp_path_factory.mktemp("parted")
    wedge = example_object("wedge")
    text = obj((1e3 * wedge.vertices).tolist(), wedge.triangles.tolist())
    part = write_text(folder / "part.obj", text)
    body = gc.load_polyhedron(part, unit="mm")
    plan = gc.plan(body, 0.5, families=("concurrent",), limit=1)
    write_text(folder / "grasps.json", plan_to_json(body, plan))
    write_text(folder / "part.grasps.toml", 'grasps = "grasps.json"\n')
    asked = ["-o", str(folder / "part.baseline.json"), "-q"]
    assert main(["baseline", "record", str(folder / "grasps.json"), *asked]) == Exit.GOOD
    return folder


@pytest.fixture
def project(parted, tmp_path):
    copied(parted, tmp_path)
    return tmp_path


def edited(project):
    """A face of the part moved by a millimetre."""
    part = project / "part.obj"
    rows = [row.split() for row in part.read_text().splitlines()]
    highest = max(float(row[3]) for row in rows if row[0] == "v")
    for row in rows:
        if row[0] == "v" and float(row[3]) == highest:
            row[3] = repr(highest + 1.0)
    write_text(part, "\n".join(map(" ".join, rows)) + "\n")
    return part


def test_a_changed_part_fails_its_tests_and_is_named(project):
    part = edited(project)
    code, said = run_pytest(project, "--grasp-report", "report")
    assert code == 1
    assert "1 failed" in said
    assert f"{part}: this is not the mesh that {project / 'grasps.json'} was planned on" in said
    assert f"graspproof plan {part}" in said
    assert "Traceback" not in said
    (line,) = json.loads((project / "report" / "report.json").read_text())["grasps"]
    assert line["status"] == "not comparable"
    assert str(part) in line["why"]


def test_an_unchanged_part_passes_and_the_report_says_which_file_it_is(project):
    code, said = run_pytest(project, "--grasp-report", "report")
    assert code == 0, said
    assert "meshes of grasps" not in said
    (line,) = json.loads((project / "report" / "report.json").read_text())["grasps"]
    assert line["mesh_file"] == str(project / "part.obj")
    assert line["mesh_note"] == ""


def test_where_there_is_no_part_it_is_said_that_a_copy_was_tested(project):
    (project / "part.obj").unlink()
    code, said = run_pytest(project, "--grasp-report", "report")
    assert code == 0, said
    note = f"{project / 'grasps.json'}: the mesh that it holds was tested"
    assert said.count(note) == 1
    assert note in (project / "report" / "index.html").read_text()
    (line,) = json.loads((project / "report" / "report.json").read_text())["grasps"]
    assert line["mesh_file"] is None
    assert line["mesh_note"].startswith(note)


def test_blessing_and_commands_refuse_a_changed_part_too(project, capsys):
    edited(project)
    before = (project / "part.baseline.json").read_text()
    with pytest.raises(ChangedPartError):
        suite_from_toml(project / "part.grasps.toml").bless()
    baseline, grasps = str(project / "part.baseline.json"), str(project / "grasps.json")
    assert main(["baseline", "check", baseline, "--bless"]) == Exit.INPUT
    assert "part.obj: this is not the mesh that" in capsys.readouterr().err
    assert main(["baseline", "record", grasps, "-o", baseline]) == Exit.INPUT
    assert (project / "part.baseline.json").read_text() == before
    with pytest.raises(ChangedPartError):
        grasp_cases(project, ["grasps.json"], {})


def test_comments_line_ends_and_the_order_of_vertices_are_no_change(project):
    saved = grasps_from_json((project / "grasps.json").read_text())
    part, found = project / "part.obj", 0
    wedge = example_object("wedge")
    last = len(wedge.vertices) - 1
    turned = obj((1e3 * wedge.vertices[::-1]).tolist(), (last - wedge.triangles).tolist())
    for text in (
        "# exported again\n" + part.read_text(),
        part.read_text().replace("\n", "\r\n"),
        turned,
    ):
        part.write_text(text, newline="")
        assert source_of(saved, project / "grasps.json", []) == Source(file=part)
        found += 1
    assert found == 3


def test_a_folder_that_is_not_there_yet_holds_no_part(project):
    (project / "part.obj").unlink()
    grasps = project / "grasps.json"
    found = source_of(
        grasps_from_json(grasps.read_text()), grasps, [project / "to" / "be" / "made"]
    )
    assert found.file is None
    assert "was tested" in found.note


def test_a_part_elsewhere_is_named_in_the_file(project):
    """And other files with the object's name then do not count."""
    elsewhere = project / "cad"
    elsewhere.mkdir()
    (project / "part.obj").rename(elsewhere / "renamed.obj")
    write_text(project / "part.stl", "another part")
    toml = project / "part.grasps.toml"
    with pytest.raises(ChangedPartError, match=r"part\.stl"):
        _ = suite_from_toml(toml).source
    write_text(toml, 'grasps = "grasps.json"\nobject = "cad/renamed.obj"\n')
    assert suite_from_toml(toml).source.file == elsewhere / "renamed.obj"
    write_text(toml, 'grasps = "grasps.json"\nobject = "cad/nowhere.obj"\n')
    with pytest.raises(gc.InputError, match=r"nowhere\.obj: "):
        _ = suite_from_toml(toml).source


def test_grasps_of_a_built_in_object_have_no_file(tmp_path):
    body = example_object("wedge")
    plan = gc.plan(body, 0.5, families=("concurrent",), limit=1)
    grasps = write_text(tmp_path / "grasps.json", plan_to_json(body, plan))
    write_text(tmp_path / "wedge.obj", "another wedge")
    saved = grasps_from_json(grasps.read_text())
    assert source_of(saved, grasps, []) == Source()
    with pytest.raises(gc.InputError, match="not planned from a mesh file"):
        source_of(saved, grasps, [], tmp_path / "wedge.obj")


def test_a_name_that_leads_elsewhere_finds_nothing(project):
    """Names come from files, and are compared, never followed."""
    (project / "sub").mkdir()
    text = (project / "grasps.json").read_text().replace('"part"', '"../part"')
    grasps = write_text(project / "sub" / "grasps.json", text)
    assert source_of(grasps_from_json(text), grasps, []).file is None
