"""`judge` judges records, writes what it finds, goes on after an interrupt, and is checked."""

import json
import shutil
from contextlib import contextmanager

import numpy as np
import pytest

from grasp_core.errors import InputError
from sim_validate.commands.exit_codes import Exit
from sim_validate.judge import sets
from sim_validate.judge.command import PAGE_FILE
from sim_validate.judge.rows import TABLE_FILE
from sim_validate.main import main
from sim_validate.protocols.verdict import Judgements
from tests.sim_validate.changing import at, changed
from tests.sim_validate.datasets.engines import Here, WorkerEndedError, contents
from tests.sim_validate.judge.four_fingers import CLOSED, HALF, TWO_OPEN, judging

parquet = pytest.importorskip("pyarrow.parquet")
pytestmark = pytest.mark.usefixtures("built_here")
FILE = "judgements.json"


@pytest.fixture(scope="module")
def judged(tmp_path_factory):
    """Words of a command that judges a closed and an open grasp, and the folder that it wrote."""
    folder = tmp_path_factory.mktemp("judged")
    words = judging(folder / "in", CLOSED, TWO_OPEN)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("sim_validate.datasets.clusters.local_processes", computed_by(Here()))
        assert main([*words, "--out", str(folder / "out"), "-q"]) == Exit.NEGATIVE
    return words, folder / "out"


def computed_by(engine):
    @contextmanager
    def started(_):
        yield engine

    return started


@pytest.fixture
def copy(judged, tmp_path):
    return shutil.copytree(judged[1], tmp_path / "copy")


def twice(found):
    """Also list a judged record as one that could not be judged."""
    found["unjudged"] = {"grasps.json#0": "lost"}
    found["record_summary"] |= {"records": 3, "unjudged": 1}


def faults(folder, answer):
    code = Exit.NEGATIVE
    return answer("dataset", "verify", folder, code=code)["faults"]


def test_a_closed_and_an_open_grasp_are_told_apart(judged):
    found = Judgements.read(judged[1] / FILE)
    closed, opened = found.records
    sides = HALF * np.array([[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0]])
    order = np.lexsort(np.round(closed.proof.positions, 6).T)
    assert closed.proof.positions[order] == pytest.approx(sides[np.lexsort(sides.T)], abs=1e-6)
    assert closed.proof.normals == pytest.approx(-closed.proof.positions / HALF, abs=1e-6)
    assert (closed.closed, closed.passed, closed.held, closed.good) == (True, True, True, True)
    assert sorted(closed.links) == ["finger0", "finger1", "finger2", "finger3"]
    assert (opened.closed, opened.contacts, opened.good) == (False, 2, False)
    assert opened.proof.verify()
    assert found.hand.joint_names == ("j0", "j1", "j2", "j3")
    assert found.hand.joint_ranges == pytest.approx(np.radians([[-30.0, 30.0]] * 4))
    (cube,) = found.objects
    assert (cube.object, cube.scale) == ("cube", 1.0)
    assert cube.radius_m == pytest.approx(HALF * 3**0.5)
    assert found.asked.tests == ("dexgraspbench",)
    assert (found.complete, dict(found.unjudged), found.object) == (True, {}, None)


def test_the_summary_counts_them(judged):
    totals = Judgements.read(judged[1] / FILE).record_summary
    assert (totals.records, totals.judged, totals.unjudged, totals.good) == (2, 2, 0, 1)
    assert (totals.closed, totals.open, totals.held) == (1, 1, 1)
    assert totals.links == 3.0
    # one angle in one bin for two joints, two angles in two bins for the others
    assert totals.joint_entropy == pytest.approx(np.log(2.0) / 2.0)


def test_the_table_has_a_row_a_record_with_the_verdicts_of_each_test(judged):
    table = parquet.read_table(judged[1] / TABLE_FILE)
    one, two = table.to_pylist()
    assert [one["id"], two["id"]] == ["grasps.json#0", "grasps.json#1"]
    assert (one["passes_dexgraspbench"], one["closed_dexgraspbench"]) == (True, True)
    assert (two["closed_dexgraspbench"], two["closed"]) == (False, False)
    assert one["passes_dexonomy"] is one["closed_mj_grasp_sim"] is None
    assert (one["contacts"], one["touching_links"], two["contacts"]) == (4, 4, 2)
    assert (one["trial_closed"], one["trial_contacts"], one["trial_reason"]) == (True, 4, "")
    assert one["closure_margin"] > 0.0 >= two["closure_margin"]
    about = table.schema.field("depth_m").metadata
    assert about[b"unit"] == b"m"


def test_the_command_says_what_and_why(judged, tmp_path, capsys):
    words, _ = judged
    assert main([*words, "--no-trial", "--out", str(tmp_path)]) == Exit.NEGATIVE
    said = capsys.readouterr()
    assert "proved open" in said.out
    assert "s each" in said.out
    assert "grasps.json#1: the contacts are proved not to be in force closure" in said.err
    assert sorted(path.name for path in tmp_path.iterdir()) == [PAGE_FILE, FILE, TABLE_FILE]


def test_the_json_of_the_command_is_the_file(judged, tmp_path, answer):
    words, _ = judged
    found = answer(*words, "--only", "*#0", "--no-trial", "--out", tmp_path)
    assert found == json.loads((tmp_path / FILE).read_text())
    assert found["records"][0]["trial"] is None


@pytest.mark.parametrize(
    ("flags", "ids"),
    [(["--only", "grasps.json#1"], ["#1"]), (["--limit", "2"], ["#0", "#1"]),
     (["--object", "c*"], ["#0", "#2"]), (["--only", "*#[12]", "--object", "*d"], ["#1"])],
    ids=str,
)  # fmt: skip
def test_records_are_chosen(flags, ids, tmp_path, monkeypatch, capsys):
    def refused(_):
        raise InputError("not judged here")

    monkeypatch.setattr(sets, "judged_unit", refused)
    words = judging(tmp_path / "in", CLOSED, CLOSED, CLOSED, objects=["cube", "old", "car"])
    main([*words, *flags, "--out", str(tmp_path / "out"), "-q"])
    capsys.readouterr()
    unjudged = Judgements.read(tmp_path / "out" / FILE).unjudged
    assert sorted(unjudged) == [f"grasps.json{each}" for each in ids]


def test_what_cannot_be_judged_loses_only_itself_and_is_listed(tmp_path, answer):
    words = judging(
        tmp_path / "in", CLOSED, CLOSED, (0.0, 99.0, 0.0, 0.0), CLOSED,
        objects=["cube", "nowhere", "cube", "cube"],
    )  # fmt: skip
    (tmp_path / "in" / "more.npz").write_text("no zip")
    words[1:2] = [words[1], str(tmp_path / "in" / "more.npz")]
    found = answer(*words, "--no-trial", "--out", tmp_path / "out", code=Exit.PARTIAL)
    assert [each["id"] for each in found["records"]] == [f"grasps.json#{k}" for k in (0, 3)]
    reasons = found["unjudged"]
    assert sorted(reasons) == ["grasps.json#1", "grasps.json#2", "more.npz"]
    assert "nowhere" in reasons["grasps.json#1"]
    assert not found["complete"]
    assert found["record_summary"]["unjudged"] == 3


def test_a_unit_that_dies_twice_loses_its_records(tmp_path, monkeypatch, answer):
    monkeypatch.setattr(sets, "UNIT_RECORDS", 1)

    def dies(unit):
        if unit.records[0].id.endswith("#1"):
            raise WorkerEndedError

    engine = computed_by(Here(dies))
    monkeypatch.setattr("sim_validate.datasets.clusters.local_processes", engine)
    words = judging(tmp_path / "in", CLOSED, CLOSED)
    found = answer(*words, "--no-trial", "--out", tmp_path / "out", code=Exit.PARTIAL)
    assert found["unjudged"] == {"grasps.json#1": "its worker ended, twice"}
    assert [each["id"] for each in found["records"]] == ["grasps.json#0"]


def test_an_interrupted_command_goes_on_and_writes_the_same(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sets, "UNIT_RECORDS", 1)
    words = judging(tmp_path / "in", CLOSED, TWO_OPEN, CLOSED)
    words += ["--no-trial", "-q", "--out"]
    assert main([*words, str(tmp_path / "whole")]) == Exit.NEGATIVE

    def interrupted(_):
        if len(engine.submitted) == 2:
            raise KeyboardInterrupt

    again, engine = str(tmp_path / "again"), Here(interrupted)
    patched = "sim_validate.datasets.clusters.local_processes"
    monkeypatch.setattr(patched, computed_by(engine))
    assert main([*words, again]) == Exit.INTERRUPTED
    assert not (tmp_path / "again" / FILE).exists()
    kept = list((tmp_path / "again" / "judging").iterdir())
    assert len(kept) == 1
    monkeypatch.setattr(patched, computed_by(engine := Here()))
    assert main([*words, again]) == Exit.NEGATIVE
    assert len(engine.submitted) == 2
    assert contents(tmp_path / "again") == contents(tmp_path / "whole")
    capsys.readouterr()


def test_what_another_question_or_a_damage_left_is_not_taken(tmp_path, monkeypatch, capsys):
    words = [*judging(tmp_path / "in", CLOSED), "--no-trial", "-q", "--out", str(tmp_path / "out")]
    patched = "sim_validate.datasets.clusters.local_processes"
    monkeypatch.setattr(sets.JudgedUnits, "remove", lambda _: None)
    submitted = []
    for more, damage in (((), False), ((), False), (("--friction", "0.4"), False), ((), True)):
        monkeypatch.setattr(patched, computed_by(engine := Here()))
        for path in (tmp_path / "out" / "judging").glob("*" if damage else "none"):
            path.write_text(path.read_text()[:100])
        assert main([*words, *more]) == Exit.GOOD
        submitted.append(len(engine.submitted))
    assert submitted == [1, 0, 1, 1]
    capsys.readouterr()


@pytest.mark.slow
def test_one_and_two_processes_write_the_same_bytes(tmp_path, monkeypatch):
    monkeypatch.undo()  # in processes of their own
    monkeypatch.setattr(sets, "UNIT_RECORDS", 1)
    words = judging(tmp_path / "in", CLOSED, TWO_OPEN, CLOSED)
    for jobs in ("1", "2"):
        out = str(tmp_path / f"out{jobs}")
        assert main([*words, "--jobs", jobs, "-q", "--out", out]) == Exit.NEGATIVE
    assert contents(tmp_path / "out1") == contents(tmp_path / "out2")


def test_contacts_alone_need_no_hand(tmp_path, answer):
    judging(tmp_path / "in", CLOSED)
    sides = HALF * np.array([[-1.0, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0]])
    contacts = [{"position_m": side.tolist(), "normal": (-side / HALF).tolist()} for side in sides]
    far = [{**each, "position_m": [2.0 * x for x in each["position_m"]]} for each in contacts]
    path = tmp_path / "cube.json"
    path.write_text(json.dumps({"grasps": [{"contacts": contacts}, {"contacts": far}]}))
    words = ["judge", path, "--objects", tmp_path / "in" / "cube.obj", "--out", tmp_path / "out"]
    found = answer(*words, code=Exit.PARTIAL)
    (one,) = found["records"]
    assert (one["closed"], one["contacts"], one["tests"], one["passed"]) == (True, 4, [], None)
    assert one["ferrari_canny"] > 0.0
    assert "within 2 mm of the object" in found["unjudged"]["cube.json#1"]
    assert found["hand"] is None
    assert answer("dataset", "verify", tmp_path / "out")["faults"] == []


def test_commands_that_cannot_be_done_say_so(judged, tmp_path, capsys):
    words, out = judged
    without = [word for place, word in enumerate(words) if place not in (2, 3)]
    for asked, code, said in (
        ([*without, "--out", str(tmp_path)], Exit.USAGE, "--hand"),
        ([*words, "--test", "none", "--out", str(tmp_path)], Exit.USAGE, "dexonomy"),
        ([*words, "--friction", "0", "--out", str(tmp_path)], Exit.USAGE, "friction"),
        ([*words, "--only", "mug*", "--out", str(tmp_path)], Exit.INPUT, "no record to judge"),
        ([*words, "--format", "none", "--out", str(tmp_path)], Exit.INPUT, "format"),
        (["judge", str(out.parent), *words[2:], "--out", str(out)], Exit.INPUT, "another --out"),
    ):
        assert main(asked) == code
        assert said in capsys.readouterr().err
    assert not any(tmp_path.iterdir())


def test_verify_finds_nothing_wrong(judged, answer):
    assert answer("dataset", "verify", judged[1])["faults"] == []


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (at("records", 0, critical_friction=0.2), "critical_friction is 0.2"),
        (at("records", 0, ferrari_canny=0.5), "ferrari_canny is 0.5"),
        (at("records", 0, "proof", margin=0.9), "the certificate proves nothing"),
        (at("records", 1, "proof", friction=[0.4, 0.4]), "the certificate proves nothing"),
        (at("records", 1, ferrari_canny=None), "ferrari_canny is None"),
        (at("records", 1, "tests", 0, closed=True), "closed is True, but False by the contacts"),
        (at("records", 0, "tests", 0, closed=False), "good"),
        (at("records", 0, "tests", 0, "runs", 2, displacement_m=1.0), "run 2"),
        (lambda found: found["records"][0]["tests"][0]["runs"].pop(), "the runs are not the 6"),
        (at("records", 0, "trial", "loads", 0, displacement_m=None), "trial"),
        (at("records", 0, "trial", reason="lost"), "trial: held is True"),
        (at("records", 0, depth_m=0.3), "depth_m"),
        (at("records", 0, closed=False), "closed"),
        (at("record_summary", good=2), "good"),
        (at("protocols", "dexgraspbench", "passing", most_m=9.0), "protocols are not the tests"),
        (at("objects", 0, object="mug"), "objects lacks its object"),
        (twice, "a record is there twice"),
        (lambda found: found["records"].pop(), "record_summary"),
    ],
)  # fmt: skip
def test_verify_finds_a_file_that_says_something_else(change, said, copy, answer):
    changed(copy / FILE, change)
    assert any(said in fault for fault in faults(copy, answer))


def test_verify_finds_a_table_that_says_something_else(copy, answer):
    table = parquet.read_table(copy / TABLE_FILE)
    rows = table.to_pylist()
    rows[1]["depth_m"] = 0.25
    arrow = pytest.importorskip("pyarrow")
    parquet.write_table(arrow.Table.from_pylist(rows, schema=table.schema), copy / TABLE_FILE)
    (fault,) = faults(copy, answer)
    assert fault == f"{TABLE_FILE}: grasps.json#1: depth_m is 0.25, but 0.0 in {FILE}"
    parquet.write_table(table.slice(0, 1), copy / TABLE_FILE)
    assert faults(copy, answer) == [
        f"{TABLE_FILE}: the file has fewer rows than {FILE} has records"
    ]
    (copy / TABLE_FILE).unlink()
    assert TABLE_FILE in faults(copy, answer)[0]


def test_a_folder_of_other_judgements_is_not_taken_for_those_of_records(
    wedge_plan, tmp_path, answer
):
    words = ["validate", wedge_plan, "--limit", "1", "--protocol", "dexonomy", "--out", tmp_path]
    answer(*words)
    assert "not of `judge`" in faults(tmp_path, answer)[0]
