"""Fills the templates of reports, which include those of single drawings."""

from pathlib import Path

from scenes.drawing import pages
from scenes.drawing.sheets import night_style

ASSETS = Path(__file__).parent / "assets"


def page(template: str, **values: object) -> str:
    """Fill a template of a report with values."""
    return pages.filled(template, ASSETS, **values)


def asset(name: str) -> str:
    """Read the text of a style sheet or script, of reports or of single drawings."""
    return pages.text_of(name, ASSETS)


def style() -> str:
    """Return the style sheet of reports, with the rules for charts on dark screens."""
    return f"{asset('style.css')}{night_style()}\n"
