"""Reports say how much of the possible each grasp reaches, and refuse files that say something
else."""

import json
import re

import pytest

from sim_validate.main import main
from sim_validate.report.report import write_report
from tests.sim_validate.changing import at, changed


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("best") / "plan"
    words = ["plan", "tetrahedron", "--limit", "3", "--best", "--gap", "0.4", "--jobs", "1"]
    assert main([*words, "--out", str(out), "-q"]) == 0
    return out


@pytest.mark.slow
def test_each_page_says_the_share_that_its_grasp_reaches_of_the_bound(folder):
    best = json.loads((folder / "best.json").read_text())
    report = write_report(folder, jobs=1)
    shares = {each["id"]: each["share_of_bound"] for each in best["planned"]}
    shares[best["grasp"]["id"]] = best["quality"][0] / best["bound"]
    assert len(shares) == 4
    for name, share in shares.items():
        text = (folder / "report" / "grasps" / f"{name}.html").read_text()
        assert "Share of the possible" in text
        assert f"{100.0 * share:.1f} %" in text
    index = (folder / "report" / "index.html").read_text()
    section = index.split('<section id="possible">')[1].split("</section>")[0]
    rows = re.findall(
        r'<th scope="row">([^<]+)</th>(?:<td>[^<]+</td>){2}<td>([\d.]+)</td>', section
    )
    assert rows[0][0] == best["grasp"]["id"]
    assert {name: float(value) for name, value in rows} == pytest.approx(
        {name: 100.0 * share for name, share in shares.items()}, abs=0.051
    )
    assert f"{best['clearance_m'] * 1e3:.3g} mm from edges" in section
    assert len(re.findall(r'data-share="', index)) == report.drawn


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"bound": -1.0}, "bound"),
        ({"bound": 0.1}, "expected at least the quality"),
        ({"object": {"name": "x", "source_sha256": "", "content_sha256": "y"}}, "object"),
    ],
)
def test_files_that_are_not_about_this_are_refused(folder, tmp_path, change, message, capsys):
    for name in ("grasps.json", "best.json"):
        (tmp_path / name).write_text((folder / name).read_text())
    changed(tmp_path / "best.json", at(**change))
    assert main(["report", str(tmp_path), "-q"]) == 4
    said = capsys.readouterr().err
    assert "best.json" in said
    assert message in said
