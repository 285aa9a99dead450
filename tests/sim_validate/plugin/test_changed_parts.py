"""A part that was changed after its grasps were planned does not pass unseen.

Its grasps are carried over to it and judged anew, or it is refused where that is asked for.
"""

import dataclasses
import json

import pytest

import grasp_core as gc
from grasp_core.files.text_files import write_text
from grasp_core.records.grasps_json import grasps_from_json, plan_to_json
from scenes.example_objects import example_object
from sim_validate.baselines.compare import Status
from sim_validate.baselines.part import ChangedPartError, Source, source_of
from sim_validate.baselines.suite import grasp_cases, suite_from_toml
from sim_validate.commands.exit_codes import Exit
from sim_validate.main import main
from tests.bad_input.mesh_texts import obj
from tests.bad_input.of_threemf import mesh, model, object_, threemf
from tests.sim_validate.changing import changed
from tests.sim_validate.plugin.project import copied, properties_in, run_pytest
from tests.sim_validate.rigs import saved_plan

TOP = 3
"""The highest face of the part."""
FACE = "face 3"


@pytest.fixture(scope="module")
def parted(tmp_path_factory):
    """A part, grasps planned on it in millimetres, and their baseline."""
    folder = tmp_path_factory.mktemp("parted")
    box = example_object("box")
    text = obj((1e3 * box.vertices).tolist(), box.triangles.tolist())
    part = write_text(folder / "part.obj", text)
    body = gc.load_polyhedron(part, unit="mm")
    plan = gc.plan(body, 0.5, families=("concurrent",))
    chosen = [grasp for grasp in plan.grasps if TOP in grasp.faces]
    plan = dataclasses.replace(plan, grasps=(chosen[0],))
    assert body.faces[TOP].centroid[2] == pytest.approx(0.025)
    write_text(folder / "grasps.json", plan_to_json(body, plan))
    write_text(folder / "part.grasps.toml", 'grasps = "grasps.json"\n')
    asked = ["-o", str(folder / "part.baseline.json"), "-q"]
    assert main(["baseline", "record", str(folder / "grasps.json"), *asked]) == Exit.GOOD
    return folder


@pytest.fixture
def project(parted, tmp_path):
    copied(parted, tmp_path)
    return tmp_path


def edited(project, by_mm=1.0, scale=1.0, digits=17):
    """The part with its highest face moved up, and then all of its numbers multiplied."""
    part = project / "part.obj"
    rows = [row.split() for row in part.read_text().splitlines()]
    points = [row for row in rows if row[0] == "v"]
    highest = max(float(row[3]) for row in points)
    for row in points:
        x, y, z = map(float, row[1:])
        moved = (x, y, z + by_mm * (z == highest))
        row[1:] = [f"{scale * number:.{digits}g}" for number in moved]
    return write_text(part, "\n".join(map(" ".join, rows)) + "\n")


def demanding(project, asked):
    """The file of the project, with more that is asked for where a part was changed."""
    toml = project / "part.grasps.toml"
    return write_text(toml, f"{toml.read_text()}[changed_part]\n{asked}\n")


def kept_in(project):
    (kept,) = properties_in(project / "j.xml")
    return kept


def test_grasps_are_carried_over_to_a_changed_part_and_it_is_said_how_it_changed(project):
    part = edited(project)
    code, said = run_pytest(project, "--junitxml", "j.xml")
    assert code == 0, said
    assert "1 passed" in said
    assert f"{part} has changed: {FACE} moved 1.00 mm outward" in " ".join(said.split())
    assert "its grasps were carried over to it" in " ".join(said.split())
    (name,) = json.loads((project / "grasps.json").read_text())["grasps"]
    assert f"  {name['id']} same\n" in said
    kept = kept_in(project)
    assert kept["status"] == "within bands"
    assert f"{FACE} moved 1.00 mm outward" in kept["mesh_note"]


def test_a_grasp_that_the_changed_part_does_not_have_fails_and_is_gone(project):
    demanding(project, "distance_m = 0.0005")
    edited(project)
    code, said = run_pytest(project, "--junitxml", "j.xml")
    assert code == 1
    assert "1 failed" in said
    kept = kept_in(project)
    assert kept["status"] == "gone"
    assert f"has lost {FACE}: the nearest face like it is 1.00 mm away" in said
    assert f"{FACE} moved 1.00 mm outward" in " ".join(said.split())
    assert "graspproof transfer" in said


def test_blessing_a_changed_part_writes_its_hash_and_then_everything_is_the_same(project):
    original = (project / "part.obj").read_text()
    part = edited(project)
    grasps = (project / "grasps.json").read_text()
    code, said = run_pytest(project, "--grasp-bless")
    assert code == 0, said
    assert f"wrote {project / 'part.baseline.json'}: 1 of 1 grasp held" in said
    record = json.loads((project / "part.baseline.json").read_text())
    assert record["object"]["content_sha256"] == gc.load_polyhedron(part, unit="mm").content_sha256
    assert (project / "grasps.json").read_text() == grasps
    suite = suite_from_toml(project / "part.grasps.toml")
    (finding,) = suite.tested(suite.ids[0]).findings
    assert (finding.status, finding.differences) == (Status.SAME, ())
    edited(project, 0.5)  # changed again; then put back, which needs no grasps to be carried over
    for text, moved in ((part.read_text(), "0.50 mm outward"), (original, "1.00 mm inward")):
        write_text(part, text)
        suite = suite_from_toml(project / "part.grasps.toml")
        (finding,) = suite.tested(suite.ids[0]).findings
        assert finding.status is Status.WITHIN
        said = f"part.obj has changed since its baseline was written: face 3 moved {moved}"
        assert said in finding.reasons[0]


def test_grasps_that_are_planned_again_are_not_compared_with_a_blessed_change(project):
    """Then the ids may name other contacts, so the baseline is of another object."""
    part = edited(project)
    suite_from_toml(project / "part.grasps.toml").bless()
    edited(project)
    body = gc.load_polyhedron(part, unit="mm")
    name = json.loads((project / "grasps.json").read_text())["grasps"][0]["id"]
    plan = gc.plan(body, 0.5, families=("concurrent",))
    plan = dataclasses.replace(plan, grasps=(plan[name],))
    write_text(project / "grasps.json", plan_to_json(body, plan))
    suite = suite_from_toml(project / "part.grasps.toml")
    (finding,) = suite.tested(suite.ids[0]).findings
    assert finding.status is Status.NOT_COMPARABLE
    assert "the object is another one" in finding.reasons[0]


def test_a_part_in_a_baseline_that_is_not_the_recorded_one_is_refused(project):
    edited(project)
    suite_from_toml(project / "part.grasps.toml").bless()
    edited(project)
    part = json.loads((project / "part.baseline.json").read_text())["part"]
    part["vertices_m"] = [[x + 0.001, y, z] for x, y, z in part["vertices_m"]]
    changed(project / "part.baseline.json", lambda record: record.update(part=part))
    with pytest.raises(gc.InputError, match="not the one that its content_sha256 says"):
        _ = suite_from_toml(project / "part.grasps.toml").compared


def test_blessing_leaves_out_a_grasp_that_is_gone_and_says_so(project):
    body = gc.load_polyhedron(project / "part.obj", unit="mm")
    plan = gc.plan(body, 0.5)
    high = next(grasp for grasp in plan.grasps if TOP in grasp.faces)
    other = next(grasp for grasp in plan.grasps if TOP not in grasp.faces)
    both = dataclasses.replace(plan, grasps=(high, other))
    write_text(project / "grasps.json", plan_to_json(body, both))
    demanding(project, "distance_m = 0.0005")
    (project / "part.baseline.json").unlink()
    edited(project)
    code, said = run_pytest(project, "--grasp-bless", "--junitxml", "j.xml")
    assert code == 0, said
    kept = kept_in(project)
    assert (kept[f"{other.id}.status"], kept[f"{high.id}.status"]) == ("blessed", "gone")
    blessed = json.loads((project / "part.baseline.json").read_text())["grasps"]
    assert [each["id"] for each in blessed] == [other.id]


def test_marked_tests_run_on_the_changed_part_and_fail_for_what_is_gone(project):
    edited(project)
    write_text(
        project / "test_it.py",
        """
import pytest

@pytest.mark.grasp("grasps.json")
def test_carried(grasp_case, assert_stable):
    assert max(grasp_case.body.vertices[:, 2]) == pytest.approx(0.026)
    assert assert_stable(grasp_case).held

@pytest.mark.grasp("grasps.json", changed_part={"distance_m": 0.0005})
def test_gone(grasp_case):
    raise AssertionError("this is never reached")
""",
    )
    code, said = run_pytest(project, "test_it.py")
    assert code == 1
    assert "1 passed, 1 error" in said, said
    assert "is gone: finger" in said
    assert "never reached" not in said.replace('"this is never reached"', "")


def test_where_there_is_no_part_a_copy_is_tested_or_it_fails_where_that_is_asked_for(project):
    (project / "part.obj").unlink()
    code, said = run_pytest(project, "--junitxml", "j.xml")
    assert code == 0, said
    note = f"{project / 'grasps.json'}: the mesh that it holds was tested"
    assert said.count(note) == 1
    assert kept_in(project)["mesh_note"].startswith(note)
    demanding(project, 'missing = "fail"')
    code, said = run_pytest(project, "--junitxml", "j.xml")
    assert code == 1
    assert "the mesh file that its grasps were planned from, 'part'" in said
    assert kept_in(project)["status"] == "not comparable"
    with pytest.raises(ChangedPartError, match="is missing"):
        grasp_cases(project, ["grasps.json"], {"changed_part": {"missing": "fail"}})


def test_a_part_saved_in_another_unit_is_said_to_be(project):
    """With eight digits the solid is nearly the same one."""
    part = project / "part.obj"
    write_text(part, part.read_text().replace("\n", "\n# edited\n", 1))
    edited(project, 1.0 / 3.0)  # so that no number is round
    suite_from_toml(project / "part.grasps.toml").bless()
    assert json.loads((project / "part.baseline.json").read_text())["unit"] == "mm"
    edited(project, 0.0, 1e-3, 8)
    code, said = run_pytest(project, "--junitxml", "j.xml")
    assert code == 0, said
    note = kept_in(project)["mesh_note"]
    assert "its numbers are 0.001 times what they were, so it is taken to be in m now" in note
    demanding(project, 'unit = "m"')
    assert "its numbers" not in run_pytest(project)[1]


ODD = 0.00026824
"""A scale of an object in a public collection."""


@pytest.fixture
def odd(parted, tmp_path):
    """A part in no unit, grasps planned on it with a scale, and their baseline."""
    copied(parted, tmp_path)
    edited(tmp_path, 0.0, 1e-3 / ODD, 15)
    body = gc.load_polyhedron(tmp_path / "part.obj", scale=ODD)
    (grasp,) = grasps_from_json((parted / "grasps.json").read_text()).grasps
    plan = gc.plan(body, 0.5, families=("concurrent",))
    chosen = tuple(each for each in plan.grasps if each.faces == grasp.faces)
    text = plan_to_json(body, dataclasses.replace(plan, grasps=chosen[:1]))
    grasps = write_text(tmp_path / "grasps.json", text)
    baseline = tmp_path / "part.baseline.json"
    assert main(["baseline", "record", str(grasps), "-o", str(baseline), "-q"]) == Exit.GOOD
    return tmp_path


def test_a_baseline_keeps_the_scale_of_its_part(odd, capsys):
    """The scale is found from the part and its file, and again used where the file has changed."""
    path = odd / "part.baseline.json"
    record = json.loads(path.read_text())
    assert (record["unit"], record["scale"]) == ("m", ODD)
    part = odd / "part.obj"
    write_text(part, "# exported again\n" + part.read_text())
    check = ["baseline", "check", str(path)]
    assert main(check) == Exit.GOOD
    assert "has changed" not in capsys.readouterr().out
    edited(odd, 1e-3 / ODD)
    assert main([*check, "--bless"]) == Exit.GOOD
    assert f"{part} has changed: {FACE} moved 1.00 mm" in " ".join(capsys.readouterr().out.split())
    record = json.loads(path.read_text())
    assert (record["unit"], record["scale"]) == ("m", ODD)
    code, said = run_pytest(odd)
    assert code == 0, said
    assert main([*check, "--changed-part.scale", "1"]) == Exit.INPUT
    said = capsys.readouterr().err
    assert "the unit of the changed part is not clear" in said
    assert "the scale if it has one" in said


def test_a_scale_is_said_where_a_changed_part_has_no_baseline(odd):
    edited(odd, 1e-3 / ODD)
    with pytest.raises(ChangedPartError, match="the scale if it has one"):
        grasp_cases(odd, ["grasps.json"], {})
    volume = gc.load_polyhedron(odd / "part.obj", scale=ODD).volume
    for args, settings in (
        (["grasps.json"], {"changed_part": {"scale": ODD}}),
        ([], {"object": "part.obj", "scale": ODD}),
    ):
        (case,) = grasp_cases(odd, args, settings)
        assert case.body.volume == pytest.approx(volume, rel=1e-12)
    with pytest.raises(gc.InputError, match=r"changed_part.*scale"):
        grasp_cases(odd, ["grasps.json"], {"changed_part": {"scale": 0.0}})


def test_a_changed_part_is_refused_by_all_where_that_is_asked_for(project, capsys):
    part, toml = edited(project), demanding(project, "refuse = true")
    before = (project / "part.baseline.json").read_text()
    code, said = run_pytest(project, "--junitxml", "j.xml")
    assert code == 1
    assert f"{part}: this is not the mesh that {project / 'grasps.json'} was planned on" in said
    assert f"graspproof plan {part}" in said
    assert "Traceback" not in said
    assert kept_in(project)["status"] == "not comparable"
    with pytest.raises(ChangedPartError):
        suite_from_toml(toml).bless()
    baseline, grasps = str(project / "part.baseline.json"), str(project / "grasps.json")
    asked = "--changed-part.refuse"
    assert main(["baseline", "check", baseline, "--bless", asked]) == Exit.INPUT
    assert "part.obj: this is not the mesh that" in capsys.readouterr().err
    assert main(["baseline", "record", grasps, "-o", baseline, asked]) == Exit.INPUT
    assert (project / "part.baseline.json").read_text() == before
    with pytest.raises(ChangedPartError):
        grasp_cases(project, ["grasps.json"], {"changed_part": {"refuse": True}})


def test_commands_carry_grasps_over_and_name_the_face(project, capsys):
    edited(project)
    baseline, grasps = str(project / "part.baseline.json"), str(project / "grasps.json")
    assert main(["baseline", "check", baseline]) == Exit.GOOD
    said = " ".join(capsys.readouterr().out.split())
    assert "1 within bands" in said
    assert f"part.obj has changed: {FACE} moved 1.00 mm outward" in said
    near = ["--changed-part.distance-m", "0.0005"]
    assert main(["baseline", "check", baseline, *near]) == Exit.NEGATIVE
    said = " ".join(capsys.readouterr().out.split())
    assert "1 gone" in said
    assert f"{FACE} moved 1.00 mm outward" in said
    before = (project / "part.baseline.json").read_text()
    assert main(["baseline", "record", grasps, "-o", baseline, *near]) == Exit.INPUT
    assert main(["baseline", "check", baseline, "--bless", "-q", *near]) == Exit.INPUT
    assert (project / "part.baseline.json").read_text() == before


def test_a_part_whose_unit_is_not_clear_asks_for_it(project):
    edited(project, 0.0, 1.6)
    with pytest.raises(ChangedPartError, match="unit of the changed part is not clear"):
        _ = suite_from_toml(project / "part.grasps.toml").present
    toml = demanding(project, 'unit = "mm"\ndistance_m = 0.001')
    assert suite_from_toml(toml).present.gone


def test_comments_line_ends_and_the_order_of_vertices_are_no_change(project):
    saved = grasps_from_json((project / "grasps.json").read_text())
    part = project / "part.obj"
    box = example_object("box")
    last = len(box.vertices) - 1
    turned = obj((1e3 * box.vertices[::-1]).tolist(), (last - box.triangles).tolist())
    for text in (
        "# exported again\n" + part.read_text(),
        part.read_text().replace("\n", "\r\n"),
        turned,
    ):
        part.write_text(text, newline="")
        assert source_of(saved, project / "grasps.json", []) == Source(file=part, unit="mm")


def test_the_same_part_in_another_format_and_unit_is_no_change(project):
    saved = grasps_from_json((project / "grasps.json").read_text())
    box, part = example_object("box"), project / "part.3mf"
    (project / "part.obj").unlink()
    solid = object_(mesh(box.vertices / 0.0254, box.triangles))
    part.write_bytes(threemf(model(solid, more='unit="inch"')))
    assert source_of(saved, project / "grasps.json", []) == Source(file=part, unit="in")


def test_a_part_elsewhere_is_named_in_the_file(project):
    elsewhere = project / "cad"
    elsewhere.mkdir()
    (project / "part.obj").rename(elsewhere / "renamed.obj")
    write_text(project / "part.stl", "another part")
    toml = project / "part.grasps.toml"
    with pytest.raises(ChangedPartError, match=r"part\.stl: .* cannot be carried over"):
        _ = suite_from_toml(toml).present
    write_text(toml, 'grasps = "grasps.json"\nobject = "cad/renamed.obj"\n')
    assert suite_from_toml(toml).present.source.file == elsewhere / "renamed.obj"
    write_text(toml, 'grasps = "grasps.json"\nobject = "cad/nowhere.obj"\n')
    with pytest.raises(gc.InputError, match=r"nowhere\.obj: "):
        _ = suite_from_toml(toml).present


def test_grasps_of_a_built_in_object_have_no_file(tmp_path):
    grasps = saved_plan(tmp_path)
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
