"""The page of judged records shows the worst and what is contradictory, and says what is left."""

import re
from collections import Counter
from functools import cache
from html.parser import HTMLParser

import numpy as np
import pytest

import grasp_core as gc
from sim_validate.engine.held_or_let_go import Outcome
from sim_validate.judge.pages import (
    MOST_OF_WORST,
    MOST_PICTURES,
    MOST_ROWS,
    Drawn,
    drawn,
    page,
    to_be_drawn,
    worst_first,
)
from sim_validate.protocols.settings import JudgeSettings
from sim_validate.protocols.verdict import (
    AboutHand,
    HandTrial,
    HeldLoad,
    Judgements,
    RecordJudgement,
    RunVerdict,
    TestOfRecord,
)
from tests.browser import (
    CLIPPED,
    CONTRASTS,
    OWN,
    READABLE,
    headless,
    needs_browser,
    opened,
    requests_of,
)
from tests.sim_validate.judge.allegro import lifted, record, stage

EVIL = '<script>document.title="taken"</script>"&\x1b'
VOID = {"meta", "link", "br", "img", "input", "hr"}
HELD, LET_GO = Outcome.HELD, Outcome.SLIPPED


@cache
def proof(closed):
    """Contacts on all six sides of a cube, or on one side of it alone."""
    normals = np.vstack([np.eye(3), -np.eye(3)]) if closed else np.tile([0.0, 0.0, 1.0], (3, 1))
    places = -normals if closed else np.array([[0.0, 0, -1], [0.1, 0, -1], [0, 0.1, -1]])
    return gc.force_closure(0.01 * places, normals, 0.5)


def trial(held, loose=False):
    loads = (HeldLoad("weight", 2.0, HELD if held else LET_GO, "", 0.0),)
    controls = (HeldLoad("one finger off", 0.0, HELD if loose else LET_GO, "", 0.0),)
    return HandTrial(4, 0.0, True, loads, controls, "" if held else "weight: it moved")


def by_test(passed, closed=True, protocol="dexgraspbench"):
    run = RunVerdict(0, passed, "" if passed else "the object fell", 0.0, 0.0, 3)
    return TestOfRecord(protocol, 0.1, closed, (run,))


def judged(name, *tests, closed=True, ours=None, depth=0.0, weakest=None, hand="leap"):
    return RecordJudgement(
        id=name, object="mug", scale=1.0, hand=hand, proof=proof(closed), undecided="",
        links=("a", "b"), depth_m=depth, own_depth_m=0.0, critical_friction=0.25,
        ferrari_canny=None, payload=None, least_push_n=None, weakest_n=weakest,
        tests=tests, trial=ours,
    )  # fmt: skip


def good(name, **more):
    return judged(name, by_test(True), ours=trial(True), **more)


def contradictions():
    return [
        judged("open", by_test(True, closed=False), ours=trial(True)),
        judged("ours-alone", by_test(False), ours=trial(True)),
        judged("theirs-alone", by_test(True), ours=trial(False)),
        judged("not-trusted", by_test(True), ours=trial(True, loose=True)),
    ]


def test_each_contradiction_is_drawn_and_what_agrees_is_not():
    agree = [good(f"good{n}") for n in range(40)]
    failed = [judged(f"bad{n}", by_test(False), closed=False, ours=trial(False)) for n in range(40)]
    found = to_be_drawn([*agree, *contradictions(), *failed])
    assert set(found) == {"open", "ours-alone", "theirs-alone", "not-trusted"}


def test_the_deepest_and_the_weakest_in_closure_are_drawn():
    deep = [good(f"deep{n}", depth=1e-3 * n) for n in range(10)]
    weak = [good(f"weak{n}", weakest=1.0 + n) for n in range(10)]
    open_ones = [judged(f"open{n}", closed=False, weakest=0.0) for n in range(10)]
    found = to_be_drawn([*open_ones, *weak, *deep])
    wanted = [f"deep{9 - n}" for n in range(MOST_OF_WORST)]
    wanted += [f"weak{n}" for n in range(MOST_OF_WORST)]
    assert sorted(found) == sorted(wanted)
    assert {"deep9", "weak0"} == set(found[:2])


def test_each_kind_has_its_share_of_the_pictures_whatever_the_order():
    many = [one for n in range(30) for one in (
        judged(f"ours{n}", by_test(False), ours=trial(True)),
        judged(f"theirs{n}", by_test(True), ours=trial(False)),
    )]  # fmt: skip
    many += [good(f"deep{n}", depth=1e-3 * (1 + n)) for n in range(9)]
    found = to_be_drawn(many)
    assert len(found) == len(set(found)) == MOST_PICTURES
    kinds = Counter(re.sub(r"\d", "", name) for name in found)
    assert kinds == {"deep": MOST_OF_WORST, "ours": 10, "theirs": 10}
    mixed = [many[place] for place in np.random.default_rng(3).permutation(len(many))]
    assert to_be_drawn(mixed) == found


def test_contacts_without_a_hand_have_no_picture():
    assert to_be_drawn([judged("alone", by_test(True, closed=False), depth=1e-3, hand="")]) == ()
    assert to_be_drawn([]) == ()


def test_the_worst_come_first():
    mixed = [
        good("d", depth=2e-3), good("c", depth=5e-3), judged("b", by_test(False)),
        judged("a", by_test(False), closed=False, ours=trial(False)),
        good("f", depth=1.0000001e-3), good("e", depth=1e-3),
    ]  # fmt: skip
    assert [each.id for each in worst_first(mixed)] == ["a", "b", "c", "d", "e", "f"]


class Page(HTMLParser):
    """Tags, text and links of a page, of which every tag must be closed where it was opened."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.rows, self.open, self.said = [], [], [], []
        self.terms, self.meanings = [], []
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in {"th", "td"}:
            self.rows[-1].append("")

    def handle_startendtag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and {"th", "td"} & set(self.open):
            self.rows[-1][-1] += data
        elif self.open and self.open[-1] == "p":
            self.said.append(data)
        elif self.open[-3:] == ["dl", "div", "dt"]:
            self.terms.append(data)
        elif self.open[-2:] == ["dd", "b"]:
            self.meanings.append(data)

    def named(self, tag):
        return [known for name, known in self.tags if name == tag]


SVG = '<svg role="img" aria-label="a hand"></svg>'


def of_set(records, unjudged=None, name="leap"):
    hand = AboutHand(name, "0" * 64, ("a",), np.array([[0.0, 1.0]]), ("its forearm is left out",))
    return Judgements(
        None, 0.5, {}, (), complete=True, records=tuple(records), unjudged=unjudged or {},
        asked=JudgeSettings(), hand=hand,
    )  # fmt: skip


def full_page():
    records = [*contradictions(), good("fine")]
    pictures = [Drawn(name, SVG) for name in to_be_drawn(records)]
    return page(of_set(records, {"x.npy#1": "joints are missing"}), pictures)


def test_the_page_says_what_was_found():
    found = Page(full_page())
    rows = {row[0]: row[1:] for row in found.rows if row[1:] != ["why"]}
    assert rows["record"][-2:] == ["passes dexgraspbench", "holds ours"]
    assert rows["fine"] == ["mug", "yes", "2", "0.250", "0.00", "yes", "yes"]
    assert rows["open"][-2:] == ["yes, but proved to be open at its friction", "yes"]
    assert rows["ours-alone"][-2:] == ["no, the object fell", "yes"]
    assert rows["theirs-alone"][-2:] == ["yes", "no, weight: it moved"]
    assert rows["not-trusted"][-1].startswith("no, the control one finger off held")
    assert rows["x.npy#1"] == ["joints are missing"]
    assert rows["dexgraspbench"] == ["4", "1", "1", "2"]  # pass, open of them, ours alone
    assert rows["friction"] == ["0.5"]
    assert rows["leap"] == ["its forearm is left out"]
    facts = dict(zip(found.terms, found.meanings, strict=True))
    assert "5 records of 1 object, 1 with nothing against them." in found.said
    assert facts["records"] == "6"
    assert facts["not judged"] == "1"
    assert facts["hold ours"] == "3"


def test_the_page_can_be_read_by_all_and_asks_nothing_of_a_network():
    text = full_page()
    found = Page(text)
    assert text.startswith("<!DOCTYPE html>")
    assert all(known.get("scope") in {"col", "row"} for known in found.named("th"))
    assert len(found.named("figure")) == 4
    assert all(each["role"] == "img" and each["aria-label"] for each in found.named("svg"))
    heads = [int(tag[1]) for tag, _ in found.tags if re.fullmatch(r"h\d", tag)]
    assert heads[0] == 1
    assert heads.count(1) == 1
    assert max(np.diff(heads)) <= 1
    ids = [known["id"] for _, known in found.tags if "id" in known]
    assert len(ids) == len(set(ids))
    links = [known["href"] for known in found.named("a")]
    assert {link[1:] for link in links} <= set(ids)
    assert {"picture-0", "picture-3"} <= {link[1:] for link in links}
    assert "prefers-color-scheme" in text
    assert "default-src 'none'" in text
    assert not re.search(r"https?:|//[a-z]|@import|url\(", text)


def test_a_record_of_two_headings_is_drawn_once_and_led_to():
    both = good("both", depth=1e-3, weakest=1.0)
    text = page(of_set([both]), [Drawn("both", SVG)])
    found = Page(text)
    assert len(found.named("svg")) == 1
    assert len(found.named("h3")) == 2
    assert '<p>Above: <a href="#picture-0">both</a>.</p>' in text


def test_long_tables_are_cut_and_say_so():
    records = [good(f"r{n}") for n in range(MOST_ROWS + 1)]
    records.append(judged("worst", by_test(False)))
    found = page(of_set(records, {f"x{n}": "broken" for n in range(MOST_ROWS + 7)}), [])
    assert f"{MOST_ROWS} of {MOST_ROWS + 2} rows; judgements.parquet has all" in found
    assert f"{MOST_ROWS} of {MOST_ROWS + 7} rows; judgements.json has all" in found
    names = [row[0] for row in Page(found).rows]
    first, second = (place for place, name in enumerate(names) if name == "record")
    assert names[first + 1] == "worst"
    assert second - first == 1 + MOST_ROWS
    assert names[second + 1 : second + 3] == ["x0", "x1"]


def test_names_are_escaped():
    bad = judged(EVIL, by_test(False, protocol=EVIL), ours=trial(False), depth=1e-3)
    text = page(of_set([bad], {EVIL: EVIL}, EVIL), [Drawn(EVIL, SVG)])
    assert "<script>document" not in text
    assert "\x1b" not in text
    assert len(Page(text).named("script")) == 1


def test_a_record_is_drawn_with_its_hand_and_contacts():
    one, away = (drawn(stage(), each) for each in (record(), lifted(0.5)))
    assert one.id == record().id
    label, off = (re.search(r'aria-label="([^"]*)"', each.picture)[1] for each in (one, away))
    count = len(stage().judged([record()])[0].links)
    assert count > 3
    assert label == f"The hand allegro in 0.npy, with {count} contacts"
    assert off.endswith("in away, with 0 contacts")
    dots = re.findall(r'stroke-linecap="round" d="([^"]*)"', one.picture)
    assert dots[0].count("M") == count  # rims, before dots of either colour
    assert sum(path.count("M") for path in dots[1:]) == count
    assert 'stroke-linecap="round"' not in away.picture


@pytest.mark.slow
@needs_browser
def test_the_page_works_in_a_browser(tmp_path):
    path = tmp_path / "judgements.html"
    pictures = [Drawn("open", drawn(stage(), record()).picture)]
    records = [*contradictions(), *(good(f"{'long-name' * 6}{n}") for n in range(5))]
    path.write_text(page(of_set(records, {"x": "broken " * 40}), pictures))
    browser = headless(tmp_path / "profile")
    try:
        for width, dark in ((1200, False), (390, True)):
            opened(browser, path, width=width, dark=dark, touch=width < 500)
            assert browser.get_log("browser") == []
            assert [url for url in requests_of(browser) if not url.startswith(OWN)] == []
            assert browser.execute_script(CLIPPED) == []
            written = browser.execute_script(CONTRASTS, "body *:not(script):not(style)")
            assert len(written) > 40
            assert [each for each in written if each[0] < READABLE] == []
        buttons = "document.querySelectorAll('#records thead button')"
        browser.execute_script(f"{buttons}[0].click()")
        rows = browser.execute_script(
            "return [...document.querySelectorAll('#records tbody th')].map((e) => e.textContent)"
        )
        assert rows == sorted(rows)
    finally:
        browser.quit()
