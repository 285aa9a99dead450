"""Writes the results of a test run as a page, and the same data as JSON.

Each result is a dictionary of plain values, as test processes send it.
"""

import json
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

from grasp_core.files.text_files import write_text
from scenes.drawing.pages import number
from sim_validate.reports.pages import asset, page

Line: TypeAlias = Mapping[str, Any]
PAGE, DATA = "index.html", "report.json"
COLUMNS = ("grasp", "what became of it", "outcome", "critical friction", "simulated",
           "weakest wrench [N]", "simulated [N]", "moved [µm]", "held with noise",
           "test")  # fmt: skip
DIGITS, ALL_DIGITS = 3, 6
"""Number of digits with which measured numbers are shown, and with which those are that differ but
look alike with fewer."""
MEASURED = ("outcome", "critical_friction", "simulated_critical_friction", "limit_n",
            "simulated_limit_n", "displacement_m")  # fmt: skip
CALM = ("same", "within bands", "stable", "blessed", "survived")


def write_report(folder: Path, lines: Iterable[Line]) -> Path:
    """Write a page and a JSON file about how each grasp ended in a test run.

    Args:
        folder: Folder to write to; it is made if it does not exist.
        lines: How each grasp ended: `test`, `grasp`, `status`, `why`, `before` and `after` as
            baselines keep them, or None, `mesh_file` or None, and `mesh_note`, which may be empty.

    Returns:
        The path of the page.
    """
    listed = sorted(lines, key=lambda line: (line["test"], line["grasp"]))
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / DATA, json.dumps({"schema": 1, "grasps": listed}, indent=1) + "\n")
    return write_text(folder / PAGE, _page(listed))


def _page(lines: Sequence[Line]) -> str:
    rows = [{"number": number, **_row(line)} for number, line in enumerate(lines)]
    told = [row for row in rows if row["why"]]
    counts = Counter(str(line["status"]) for line in lines)
    return page(
        "stability.html",
        style=asset("style.css"),
        script=asset("tables.js"),
        counts=[
            (name, count, name in CALM)
            for name, count in sorted(counts.items(), key=lambda each: (each[0] in CALM, each[0]))
        ],
        notes=sorted({line["mesh_note"] for line in lines if line["mesh_note"]}),
        reasons=(
            ("To look at", [row for row in told if not row["calm"]]),
            ("Differs within its bands", [row for row in told if row["calm"]]),
        ),
        columns=COLUMNS,
        rows=rows,
    )


def _row(line: Line) -> dict[str, Any]:
    """Build the contents of one row of the page's table."""
    after: Line = line["after"] or {}
    before: Line = line["before"] or {}
    trials = after.get("noisy_trials")
    held = trials - len(after["noisy_not_held"]) if trials else 0
    return {
        "calm": line["status"] in CALM,
        "test": line["test"],
        "grasp": line["grasp"],
        "status": line["status"],
        "measured": [_measured(name, before, after) for name in MEASURED],
        "repeats": f"{held} of {trials}" if trials else "",
        "why": line["why"],
    }


def _measured(name: str, before: Line, after: Line) -> tuple[str, str]:
    """Write a measured number, and its former value if that differs."""
    for digits in (DIGITS, ALL_DIGITS):
        now, was = _said(name, after, digits), _said(name, before, digits)
        if now != was:
            return now, was if before else ""
    return _said(name, after, DIGITS), ""


def _said(name: str, entry: Line, digits: int) -> str:
    value = entry.get(name)
    if not entry or isinstance(value, str):
        return value or ""
    return number(1e6 * value if name == "displacement_m" and value is not None else value, digits)
