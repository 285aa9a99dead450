"""What became of grasps in a run of tests -> a folder with a page and the same as JSON.

A line is a dictionary of plain values, as it travels from test processes.
"""

import json
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias
from xml.etree import ElementTree

from sim_validate.baselines.explaining import number
from sim_validate.files import write_text

Line: TypeAlias = Mapping[str, Any]
PAGE, DATA = "index.html", "report.json"
COLUMNS = ("test", "grasp", "what became of it", "outcome", "critical friction", "in simulation",
           "weakest wrench, N", "in simulation", "moved, um", "held with noise", "why")  # fmt: skip
CALM = ("same", "within bands", "stable", "blessed")
STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem; color: #223; }
table { border-collapse: collapse; } th, td { padding: .3rem .7rem; text-align: left; }
th { border-bottom: 2px solid #889; } td { border-bottom: 1px solid #dde; vertical-align: top; }
tr.calm td:nth-child(3) { color: #275; } tr.alarm td:nth-child(3) { color: #b21; font-weight: 600; }
td pre { margin: 0; white-space: pre-wrap; font-size: 12px; } .was { color: #889; }
"""


def write_report(folder: Path, lines: Iterable[Line]) -> Path:
    """Write the page and the data.

    Args:
        folder: Is made if it is not there.
        lines: What became of each grasp: `test`, `grasp`, `status`, `why`, and `before` and `after`
            as baselines keep them, or None.

    Returns:
        The path of the page.
    """
    listed = sorted(lines, key=lambda line: (line["test"], line["grasp"]))
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / DATA, json.dumps({"schema": 1, "grasps": listed}, indent=1) + "\n")
    return write_text(folder / PAGE, _page(listed))


def _page(lines: Sequence[Line]) -> str:
    html = ElementTree.Element("html", lang="en")
    head = _add(html, "head")
    ElementTree.SubElement(head, "meta", charset="utf-8")
    _add(head, "title", "Stability of grasps")
    _add(head, "style", STYLE)
    body = _add(html, "body")
    _add(body, "h1", "Stability of grasps")
    counts = Counter(str(line["status"]) for line in lines)
    _add(body, "p", ", ".join(f"{count} {name}" for name, count in sorted(counts.items())))
    table = _add(body, "table")
    titles = _add(table, "tr")
    for title in COLUMNS:
        _add(titles, "th", title)
    for line in lines:
        _row(table, line)
    text = ElementTree.tostring(html, encoding="unicode", method="html")
    return f"<!DOCTYPE html>\n{text}\n"


def _row(table: ElementTree.Element, line: Line) -> None:
    row = _add(table, "tr")
    row.set("class", "calm" if line["status"] in CALM else "alarm")
    for text in (line["test"], line["grasp"], line["status"]):
        _add(row, "td", str(text))
    after: Line = line["after"] or {}
    before: Line = line["before"] or {}
    for name in ("outcome", "critical_friction", "simulated_critical_friction", "limit_n",
                 "simulated_limit_n", "displacement_m"):  # fmt: skip
        cell = _add(row, "td", _said(name, after))
        if before and _said(name, before) != _said(name, after):
            _add(cell, "div", f"was {_said(name, before)}").set("class", "was")
    trials = after.get("noisy_trials")
    held = trials - len(after["noisy_not_held"]) if trials else 0
    _add(row, "td", f"{held} of {trials}" if trials else "")
    _add(_add(row, "td"), "pre", str(line["why"]))


def _said(name: str, entry: Line) -> str:
    value = entry.get(name)
    if not entry or isinstance(value, str):
        return value or ""
    return number(1e6 * value if name == "displacement_m" and value is not None else value)


def _add(parent: ElementTree.Element, tag: str, text: str = "") -> ElementTree.Element:
    child = ElementTree.SubElement(parent, tag)
    child.text = "".join(c if c.isprintable() or c == "\n" else " " for c in text)
    return child
