"""The page of `--grasp-report`: reasons can be read without scrolling sideways."""

import re

import pytest

from sim_validate.reports.stability_page import write_report
from tests.browser import headless, needs_browser, opened

WHY = "c-0-1-2-7: regressed\n" + "\n".join(f"  {'a reason, ' * 9}{i}" for i in range(25))
ENTRY = {
    "outcome": "held", "critical_friction": 0.31, "simulated_critical_friction": 0.3101,
    "limit_n": 2.5, "simulated_limit_n": None, "displacement_m": 1e-6, "noisy_trials": 0,
}  # fmt: skip


def line(grasp, status, why="", note=""):
    return {
        "test": f"tests/parts/a_long_name_of_a_file.grasps.toml::{grasp}", "grasp": grasp,
        "status": status, "why": why, "before": ENTRY | {"limit_n": 3.0}, "after": ENTRY,
        "mesh_file": None, "mesh_note": note,
    }  # fmt: skip


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    lines = [
        line("c-0-1-2-3", "same", note="grasps.json: the mesh that it holds was tested"),
        line("c-0-1-2-7", "regressed", WHY),
        line("c-0-1-2-8", "within bands", "c-0-1-2-8: <b>within</b> bands"),
    ]
    return write_report(tmp_path_factory.mktemp("report"), lines)


def test_reasons_stand_before_the_table_and_what_failed_stands_first(report):
    page = report.read_text()
    before, _, table = page.partition("<table")
    assert "a reason" not in table
    reasons = re.findall(
        r'<h3 id="(why-\d)">.*?</h3>\s*<pre class="why" tabindex="0">(.*?)</pre>', before, re.S
    )
    assert [text.splitlines()[0] for _, text in reasons] == [
        "c-0-1-2-7: regressed",
        "c-0-1-2-8: &lt;b&gt;within&lt;/b&gt; bands",
    ]
    assert re.findall(r'href="#(why-\d)"', table) == [name for name, _ in reasons]
    assert table.count("<tr") == 4
    assert "was 3" in table
    assert before.count("the mesh that it holds was tested") == 1


def test_each_row_has_a_cell_for_each_column(report):
    rows = re.findall(r"<tr>(.*?)</tr>", report.read_text(), re.S)
    counts = {len(re.findall(r"<t[hd]", row)) for row in rows}
    assert counts == {10}


@pytest.mark.slow
@needs_browser
@pytest.mark.parametrize("width", [360, 1200])
def test_reasons_are_on_the_screen_and_rows_are_low(report, tmp_path, width):
    browser = headless(tmp_path)
    try:
        opened(browser, report, width=width, touch=width < 500)
        box = "getBoundingClientRect()"
        assert browser.execute_script("return document.documentElement.scrollWidth") <= width
        rights = browser.execute_script(
            f"return [...document.querySelectorAll('.why')].map((e) => e.{box}.right)"
        )
        heights = browser.execute_script(
            f"return [...document.querySelectorAll('tr')].map((e) => e.{box}.height)"
        )
    finally:
        browser.quit()
    assert len(rights) == 2
    assert max(rights) <= width
    assert len(heights) == 4
    # a name in five lines; on a narrow screen ten cells below one another, a name in two lines
    assert max(heights) <= (150.0 if width > 500 else 300.0)
