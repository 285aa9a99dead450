"""`validate --protocol` and `reach --protocol` judge, show, write, and end with the right code."""

import json
import shutil

import pytest

from sim_validate.commands.exit_codes import Exit
from sim_validate.judge.formats.reading import read_records
from sim_validate.main import main
from sim_validate.protocols.verdict import Judgements
from tests.sim_validate.changing import at, changed


def finite(document):
    return json.loads(document, parse_constant=lambda text: pytest.fail(f"{text} is no JSON"))


def test_grasps_are_judged_by_each_test(wedge_plan, tmp_path, capsys):
    words = ["validate", str(wedge_plan), "--protocol", "dexgraspbench", "--protocol", "dexonomy"]
    assert main([*words, "--out", str(tmp_path)]) == Exit.GOOD
    assert capsys.readouterr().out.count("dexonomy") == 3
    text = (tmp_path / "judgements.json").read_text()
    document = finite(text)
    assert document["complete"]
    assert set(document["protocols"]) == {"dexgraspbench", "dexonomy"}
    for each in document["judgements"]:
        test = document["protocols"][each["protocol"]]
        assert each["theirs"]
        assert each["held"]
        assert each["closed"]
        assert each["predicted"]
        assert each["margin"] > 1.0
        assert len(each["runs"]) == len(test["runs"])
    every = {"grasps": 2, "theirs_passed": 2, "ours_held": 2, "predicted": 2, "agree": 2}
    names = ("dexgraspbench", "dexonomy")
    assert document["summary"] == {name: {"protocol": name, **every} for name in names}
    assert Judgements.read(tmp_path / "judgements.json").text() == text
    assert document["protocols"]["dexgraspbench"]["sources"][0]["commit"].startswith("1e7a5a6f")


def test_a_test_without_loads_has_a_margin_of_null(wedge_plan, capsys):
    code = main(
        ["validate", str(wedge_plan), "--limit", "1", "--protocol", "mj-grasp-sim", "--json"]
    )
    document = finite(capsys.readouterr().out)
    (judgement,) = document["judgements"]
    assert judgement["margin"] is None
    assert document["protocols"]["mj-grasp-sim"]["passing"]["most_m"] is None
    assert code == Exit.GOOD


def test_fingers_that_hardly_push_fail_and_the_command_says_why(wedge_plan, capsys):
    """The weight of a decagram of push is nothing beside one newton."""
    words = ["--protocol", "dexgraspbench", "--max-normal-force-n", "0.01", "--limit", "1"]
    assert main(["validate", str(wedge_plan), *words]) == Exit.NEGATIVE
    found = capsys.readouterr()
    assert "moved by" in found.err
    assert "ours:" in found.err


def test_a_report_shows_what_each_test_says_and_new_judgements_remove_it(wedge_plan, tmp_path):
    run = tmp_path / "run"
    run.mkdir()
    shutil.copy(wedge_plan, run)
    words = ["validate", str(run / "grasps.json"), "--limit", "1", "--out", str(run), "-q"]
    main([*words, "--protocol", "dexgraspbench"])
    main(["report", str(run), "--limit", "1", "-q"])
    page = (run / "report" / "index.html").read_text()
    assert "Judged by other tools" in page
    assert '<th scope="row">dexgraspbench</th>' in page
    main([*words, "--protocol", "dexonomy"])
    assert not (run / "report").exists()


@pytest.fixture(scope="module")
def judged(wedge_plan, tmp_path_factory):
    """A folder with a grasp that is judged."""
    folder = tmp_path_factory.mktemp("judged")
    shutil.copy(wedge_plan, folder)
    words = ["validate", str(folder / "grasps.json"), "--limit", "1", "--out", str(folder), "-q"]
    assert main([*words, "--protocol", "dexonomy"]) == Exit.GOOD
    return folder


@pytest.mark.parametrize(
    ("change", "said"),
    [(lambda record: record["judgements"][0].pop("closed"), "closed"),
     (at("object", content_sha256="0"), "another object"),
     (at("summary", "dexonomy", more=1), "summary")],
    ids=["field", "object", "unknown"],
)  # fmt: skip
def test_a_report_refuses_judgements_that_do_not_fit(change, said, judged, tmp_path, capsys):
    for path in judged.iterdir():
        shutil.copy(path, tmp_path)
    changed(tmp_path / "judgements.json", change)
    assert main(["report", str(tmp_path), "-q"]) == Exit.INPUT
    found = capsys.readouterr().err
    assert "judgements.json" in found
    assert said in found


def test_a_hand_is_judged_and_its_records_are_written(bracket_plan, tmp_path, capsys):
    words = ["reach", str(bracket_plan), "--limit", "1", "--hand", "allegro"]
    words += ["--torque-limit-n-m", "0.7"]
    more = ["--simulate", "--protocol", "dexgraspbench", "--out", str(tmp_path / "out")]
    code = main([*words, *more, "--dexgraspbench", str(tmp_path / "records")])
    found = capsys.readouterr()
    document = finite((tmp_path / "out" / "judgements.json").read_text())
    reached = finite((tmp_path / "out" / "reaches.json").read_text())
    ids = [each["id"] for each in reached["reaches"] if each["reached"]]
    assert ids
    assert [each["id"] for each in document["judgements"]] == ids
    assert all(each["hand"] == "allegro" for each in document["judgements"])
    good = all(e["theirs"] and e["held"] for e in document["judgements"])
    assert code == (Exit.GOOD if good else Exit.NEGATIVE)
    assert reached["complete"]
    assert all(each["simulated"] is None for each in reached["reaches"])
    assert "is not convex" in found.err
    names = sorted(path.name for path in (tmp_path / "records" / "graspdata").iterdir())
    assert names == sorted(f"{each}.npy" for each in ids)
    (first,) = read_records([tmp_path / "records" / "graspdata" / names[0]])
    assert len(first.grasp.joints) == 16


def test_a_hand_is_judged_in_simulation_only(bracket_plan, capsys):
    assert main(["reach", str(bracket_plan), "--protocol", "dexgraspbench"]) == Exit.USAGE
    assert "--simulate" in capsys.readouterr().err
