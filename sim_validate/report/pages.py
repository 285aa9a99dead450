"""Fills the templates of reports, which include those of single drawings."""

from collections.abc import Sequence
from pathlib import Path

from grasp_core.figures import figures
from scenes.drawing import pages
from scenes.drawing.sheets import night_style
from sim_validate.report.agreement import BAD, GOOD, Record

ASSETS = Path(__file__).parent / "assets"


def page(template: str, **values: object) -> str:
    """Fill a template of a report with values."""
    return pages.filled(template, ASSETS, **values)


def records_table(records: Sequence[object], kind: type) -> Record:
    """Build a table of the figures of records, for the template `records.html`.

    A figure that is true is good, and one that is false is bad. Those that no record has are left
    out.
    """
    listed = [each for each in figures(kind) if any(each.of(one) is not None for one in records)]
    tones = {True: GOOD, False: BAD}
    return {
        "columns": [(figure.shown.heading, figure.meaning) for figure in listed],
        "rows": [
            [
                (figure.cell(one), tones[value] if isinstance(value, bool) else "")
                for figure in listed
                for value in [figure.of(one)]
            ]
            for one in records
        ],
    }


def asset(name: str) -> str:
    """Read the text of a style sheet or script, of reports or of single drawings."""
    return pages.text_of(name, ASSETS)


def style() -> str:
    """Return the style sheet of reports, with the rules for charts on dark screens."""
    return f"{asset('style.css')}{night_style()}\n"
