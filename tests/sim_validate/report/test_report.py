"""Reports hold what the files of a run say, whatever these are called."""

import json
import re
import shlex
import shutil
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from grasp_core.errors import InputError
from grasp_core.records.grasps_json import load_grasps
from sim_validate.closure.verdict import Verdicts
from sim_validate.commands.exit_codes import Exit
from sim_validate.main import main
from sim_validate.report.report import write_report
from tests.scenes.drawing.whole import assert_contacts
from tests.sim_validate.changing import at, changed, changed_verdicts, slipped

pytestmark = pytest.mark.usefixtures("no_pictures")
EVIL = '<script>document.title="taken"</script>"\'&\x1b[31m'


class Page(HTMLParser):
    """Tags, links and text of a page."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.links, self.said, self.data = [], [], [], {}
        self.inside = None
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        known = dict(attrs)
        self.tags.append((tag, known))
        self.links += [known[name] for name in ("href", "src") if name in known]
        self.inside = known.get("id") if tag == "script" else None

    def handle_endtag(self, _):
        self.inside = None

    def handle_data(self, data):
        if self.inside:
            self.data[self.inside] = self.data.get(self.inside, "") + data
        self.said.append(data)


def pages_of(report):
    return {path: Page(path.read_text()) for path in report.rglob("*.html")}


def test_every_grasp_has_a_card_and_a_page(small_run, small_report):
    ids = [grasp.id for grasp in load_grasps(small_run / "grasps.json").grasps]
    assert len(ids) == 3
    index = Page((small_report / "index.html").read_text())
    cards = [known for tag, known in index.tags if tag == "li" and known.get("class") == "card"]
    assert [card["data-find"].split()[0] for card in cards] == ids
    assert {card["data-verdict"] for card in cards} == {"held"}
    assert sorted(path.stem for path in (small_report / "grasps").iterdir()) == sorted(ids)


def test_every_link_leads_to_a_file_of_the_report(small_report):
    count = 0
    for path, page in pages_of(small_report).items():
        for link in page.links:
            if not link.startswith(("#", "data:")):
                assert (path.parent / link).resolve().is_relative_to(small_report.resolve())
                assert (path.parent / link).is_file()
                count += 1
    assert count > 30


def test_nothing_is_asked_of_a_network(small_report):
    for path in small_report.rglob("*"):
        if path.suffix in {".html", ".css", ".js"}:
            text = re.sub(r"data:[\w/;,+=]*", "", path.read_text())  # pictures within the page
            assert not re.search(r"https?:|//[a-z]|@import|url\(", text)
    assert all("Content-Security-Policy" in path.read_text()
               for path in small_report.rglob("*.html"))  # fmt: skip


def test_a_page_says_what_the_files_say(small_run, small_report):
    verdicts = Verdicts.read(small_run / "verdicts.json")
    regions = json.loads((small_run / "regions.json").read_text())
    for verdict, certified in zip(verdicts, regions["grasps"], strict=True):
        page = Page((small_report / "grasps" / f"{verdict.id}.html").read_text())
        said = " ".join(page.said)
        lever = verdict.scale.grasp_size_m
        for trial in verdict.wrenches:
            assert trial.name in said
            force, torque = np.reshape(trial.wrench, (2, 3))
            size = np.linalg.norm([*force, *(torque / lever)])
            assert f"{size * trial.simulated_limit:.3g}" in said
        assert f"{verdict.simulated_critical_friction:.3g}" in said
        for control in verdict.controls:
            assert control.control.name.replace("_", " ") in said
        assert f"{1e3 * certified['disc_radius_m']:.3g} mm" in said
        assert certified["proof"]["file"] in said
        assert "held 2 of 2 times" in said
        for field, name in (("displacement_m", "um moved"),
                            ("start_displacement_m", "um when loaded")):  # fmt: skip
            most = 1e6 * max(getattr(trial.hold, field) for trial in verdict.wrenches)
            place = page.said.index(name)
            assert float(page.said[place + 1].split()[0]) == pytest.approx(most, rel=0.06)
        assert f"the size of the grasp, {1e3 * lever:.3g} mm, so that the limit of a torque" in said


def test_the_drawing_is_that_of_the_grasp(small_run, small_report):
    saved = load_grasps(small_run / "grasps.json")
    for grasp in saved.grasps:
        page = Page((small_report / "grasps" / f"{grasp.id}.html").read_text())
        shapes = json.loads(page.data["drawing"])["shapes"]
        assert_contacts(shapes, saved.body, grasp.positions)
        assert sum(shape["role"] == "region" for shape in shapes) == 4
    text = (small_report / "object-0.js").read_text()
    drawn = json.loads(text.partition("= ")[2].rstrip(";\n"))
    assert [shape["role"] for shape in drawn] == ["object", "edge"]


def test_its_commands_are_commands(small_run, small_report, asked, monkeypatch):
    monkeypatch.chdir(small_run)
    text = next((small_report / "grasps").iterdir()).read_text()
    (block,) = re.findall(r"<pre>(.*?)</pre>", text, re.DOTALL)
    lines = [line for line in block.splitlines() if line]
    assert len(lines) >= 5
    for line in lines:
        assert main(shlex.split(line)[1:]) == Exit.GOOD
    assert {type(command).__name__ for command in asked} == {"View", "Replay"}


@pytest.fixture
def copy(small_run, tmp_path):
    return shutil.copytree(small_run, tmp_path / "copy")


def without_proofs(document):
    known = ("id", "contacts_sha256", "family", "planned_radius_m")
    named = {name: document["grasps"][0][name] for name in known}
    document["grasps"][0] = (
        dict.fromkeys(document["grasps"][0]) | named | {"reason": EVIL, "closed_share_reason": ""}
    )
    document["summary"]["proved"] -= 1


def spoiled(found):
    """The verdicts of the run with evil names, one of them a contradiction."""
    verdict = slipped(found[0])
    wrenches = (*verdict.wrenches[:-1], replace(verdict.wrenches[-1], name=EVIL))
    control = replace(verdict.controls[0].control, name=EVIL)
    controls = (replace(verdict.controls[0], control=control),)
    first = replace(verdict, wrenches=wrenches, controls=controls)
    checks = (replace(found.gate.checks[0], name=EVIL), *found.gate.checks[1:])
    gate = replace(found.gate, checks=checks)
    return replace(found, gate=gate, verdicts=(first, *found.verdicts[1:]))


def test_names_are_escaped(copy, tmp_path):
    changed(copy / "grasps.json", at("object", name=EVIL))
    changed_verdicts(copy / "verdicts.json", spoiled)
    changed(copy / "regions.json", without_proofs)
    index = write_report(copy, tmp_path / "out", jobs=1).index
    pages = pages_of(index.parent)
    assert len(pages) == 4
    for path, page in pages.items():
        assert "<script>document" not in path.read_text()
        assert "\x1b" not in path.read_text()
        assert EVIL.replace("\x1b", " ") in "".join(page.said)
        assert {known.get("src") for tag, known in page.tags if tag == "script"} <= {
            None, "gallery.js", "tables.js", "../tables.js", "../turntable.js", "../object-0.js",
        }  # fmt: skip
    assert "contradicts the analysis" in pages[index].said


def test_without_verdicts_grasps_are_shown(copy, tmp_path):
    (copy / "verdicts.json").unlink()
    (copy / "regions.json").unlink()
    report = write_report(copy, tmp_path / "out", jobs=1)
    index = Page(report.index.read_text())
    assert report.grasps == 3
    assert index.said.count("not validated") == 4  # three cards, and the choice
    assert 'id="fidelity"' not in report.index.read_text()


def test_an_interrupted_run_is_called_that(copy, tmp_path):
    path = copy / "verdicts.json"
    changed_verdicts(path, lambda found: replace(found[:1], complete=False))
    said = " ".join(Page(write_report(copy, tmp_path / "out", jobs=1).index.read_text()).said)
    assert "the run was interrupted" in said
    assert "not validated" in said


def test_of_many_grasps_those_with_bad_news_are_shown(copy, tmp_path):
    last = Verdicts.read(copy / "verdicts.json")[-1].id

    def slip(found):
        return replace(found, verdicts=(*found.verdicts[:-1], slipped(found[-1])))

    changed_verdicts(copy / "verdicts.json", slip)
    report = write_report(copy, tmp_path / "out", jobs=1, limit=1)
    assert report.grasps == 1
    assert [path.stem for path in (tmp_path / "out" / "grasps").iterdir()] == [last]
    said = " ".join(Page(report.index.read_text()).said)
    assert "3 grasps at friction 0.5" in said
    assert "1 are shown" in said


def test_several_runs_make_one_report(copy, tmp_path):
    both = tmp_path / "both"
    shutil.copytree(copy, both / "b")
    shutil.copytree(copy, both / "a")
    changed(both / "b" / "grasps.json", at("object", name="other"))
    (both / "empty").mkdir()
    report = write_report(both, jobs=1, limit=1)
    assert report.grasps == 2
    assert report.index == both / "report" / "index.html"
    index = Page(report.index.read_text())
    shown = [known["data-object"] for tag, known in index.tags if known.get("class") == "card"]
    assert shown == ["wedge", "other"]
    assert len(pages_of(both / "report")) == 3


def test_an_earlier_report_stays_until_the_new_one_is_complete(copy, tmp_path):
    told = []

    def stop(*_):
        raise KeyboardInterrupt

    first = write_report(copy, tmp_path / "out", jobs=1)
    before = {path: path.read_bytes() for path in (tmp_path / "out").rglob("*") if path.is_file()}
    with pytest.raises(KeyboardInterrupt):
        write_report(copy, tmp_path / "out", jobs=1, limit=1, progress=stop)
    after = {path: path.read_bytes() for path in (tmp_path / "out").rglob("*") if path.is_file()}
    assert after == before
    assert [path for path in (tmp_path / "out").iterdir() if path.name.startswith(".rep")] == []
    second = write_report(copy, tmp_path / "out", jobs=1, limit=1, ready=lambda *_: told.append(1))
    assert second.index == first.index
    assert second.grasps == 1 == len(list((tmp_path / "out" / "grasps").iterdir()))
    assert told == []
    old, own = (tmp_path / "out" / name for name in ("grasps/c-9-9-9-9.html", "notes.txt"))
    for path in (old, own):
        path.write_text("old")
    write_report(copy, tmp_path / "out", jobs=1, limit=1)
    assert not old.exists()
    assert own.read_text() == "old"
    with pytest.raises(KeyboardInterrupt):
        write_report(copy, tmp_path / "new", jobs=1, progress=stop)
    assert not (tmp_path / "new").exists()


def test_pages_are_not_put_among_other_things(copy, tmp_path, capsys):
    """Such as the pages and pictures of somebody else's site."""
    names = ("index.html", "style.css", "clips/a.webp")
    for name in names:
        (tmp_path / "site" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "site" / name).write_text("mine")
    assert main(["report", str(copy), "--out", str(tmp_path / "site")]) == Exit.INPUT
    assert "holds other files than a report" in capsys.readouterr().err
    assert all((tmp_path / "site" / name).read_text() == "mine" for name in names)
    shutil.copytree(tmp_path / "site", copy / "report")
    assert main(["run", "wedge", "--limit", "1", "--out", str(copy), "-q"]) == Exit.INPUT
    assert (copy / "verdicts.json").is_file()


def test_regions_for_more_friction_are_not_shown(copy, tmp_path):
    changed(copy / "regions.json", at(friction=0.6))
    pages = pages_of(write_report(copy, tmp_path / "out", jobs=1, limit=1).index.parent)
    said = " ".join(next(page for path, page in pages.items() if path.stem != "index").said)
    assert "Certified regions are for friction 0.6: not shown" in said
    assert "Regions are certified" not in said


@pytest.mark.parametrize(
    ("file", "change", "says"),
    [
        ("verdicts.json", at("object", content_sha256="0"), "another object"),
        ("verdicts.json", at("verdicts", 0, contacts_sha256="0"), "contradicts"),
        ("regions.json", at("grasps", 0, contacts_sha256="0"), "contacts"),
    ],
)  # fmt: skip
def test_files_that_are_not_ours_are_refused(copy, file, change, says):
    changed(copy / file, change)
    with pytest.raises(InputError, match=says):
        write_report(copy, jobs=1)
    assert not (copy / "report" / "index.html").exists()
