"""Copies of a grasp by symmetry share a card, and the first page can be opened early."""

import json
from dataclasses import replace

import pytest

import sim_validate as sv
from grasp_core.records.grasps_json import load_grasps
from sim_validate.closure.verdict import Verdicts
from sim_validate.commands.exit_codes import Exit
from sim_validate.main import main
from sim_validate.report.cards import cards_of
from sim_validate.report.report import FIRST, write_report
from sim_validate.report.run_folder import runs_in
from tests.scenes.drawing.whole import assert_contacts
from tests.sim_validate.changing import slipped
from tests.sim_validate.report.test_report import Page


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    """The folder of a plan with many copies, and with more cards than are drawn at first."""
    folder = tmp_path_factory.mktemp("planned")
    asked = ["plan", "octahedron", "--limit", "16", "--out", str(folder), "-q"]
    assert main([*asked, "--families", "concurrent,pencil"]) == Exit.GOOD
    return folder


@pytest.fixture(scope="module")
def drawn(planned, tmp_path_factory):
    """Its report, and what the first page held when it was first ready."""
    early = []

    def note(index, done, total):
        links = [link for link in Page(index.read_text()).links if not link.startswith("#")]
        early.append((index.read_text(), done, total, [(index.parent / x).is_file() for x in links
                                                       if not x.startswith("data:")]))  # fmt: skip

    report = write_report(planned, tmp_path_factory.mktemp("report"), jobs=1, ready=note)
    return report, early


def cards_in(text):
    return [known for tag, known in Page(text).tags if known.get("class") == "card"]


def test_every_grasp_has_a_page_and_every_card_names_its_copies(planned, drawn):
    report, _ = drawn
    ids = [grasp.id for grasp in load_grasps(planned / "grasps.json").grasps]
    folder = report.index.parent
    assert sorted(path.stem for path in (folder / "grasps").iterdir()) == sorted(ids)
    cards = cards_in(report.index.read_text())
    assert report.grasps == len(ids)
    assert report.drawn == len(cards) == len(list((folder / "pictures").iterdir())) < len(ids)
    named = [name for card in cards for name in card["data-find"].replace("octahedron", "").split()]
    assert sorted(named) == sorted(ids)
    assert sum(int(card["data-count"]) for card in cards) == len(ids)
    links = Page(report.index.read_text()).links
    assert {f"grasps/{name}.html" for name in ids} <= set(links)


def test_the_page_of_a_copy_has_its_own_numbers_and_leads_to_the_pictures(planned, drawn):
    report, _ = drawn
    (run,) = runs_in(planned)
    grasps = run.saved.grasps
    count = 0
    for card in cards_of(run):
        first = grasps[card.first]
        page = Page((report.index.parent / "grasps" / f"{first.id}.html").read_text())
        assert any(tag == "img" for tag, _ in page.tags)
        for place in (*card.rotated, *card.mirrored):
            copy = grasps[place]
            text = (report.index.parent / "grasps" / f"{copy.id}.html").read_text()
            found = Page(text)
            assert f"../grasps/{copy.id}.html" in page.links
            assert f"../grasps/{first.id}.html" in found.links
            assert not any(tag == "img" for tag, _ in found.tags)
            assert ("mirrored" if place in card.mirrored else "rotated") in " ".join(found.said)
            shapes = json.loads(found.data["drawing"])["shapes"]
            assert_contacts(shapes, run.saved.body, copy.positions)
            count += 1
    assert count == report.grasps - report.drawn > 0


def test_the_first_page_is_ready_before_the_others_are_drawn(drawn):
    report, early = drawn
    ((text, done, total, found),) = early
    assert (done, total) == (FIRST, report.drawn)
    assert len(cards_in(text)) == FIRST < report.drawn
    assert f"{total - done} more cards are being drawn: reload this page" in text
    assert len(found) > FIRST
    assert all(found)
    assert "are being drawn" not in report.index.read_text()


def test_a_problem_is_not_hidden_behind_a_copy_that_held(planned):
    (run,) = runs_in(planned)
    whole = cards_of(run)
    card = next(each for each in whole if len(each.places) > 1)
    body, grasps = run.saved.body, run.saved.grasps
    held = sv.validate(body, grasps[0], agenda=sv.Agenda(controls=False, critical_friction=False))
    verdicts = [replace(held, id=grasp.id) for grasp in grasps]
    tested = Verdicts.of(body, 0.5, held.gate, tuple(verdicts))
    assert cards_of(replace(run, tested=tested)) == whole
    last = card.places[-1]
    verdicts[last] = slipped(verdicts[last])
    cards = cards_of(replace(run, tested=replace(tested, verdicts=tuple(verdicts))))
    assert len(cards) == len(whole) + 1
    assert [each.places for each in cards if each.first == card.places[-1]] == [card.places[-1:]]
