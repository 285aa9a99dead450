"""Says how much of the possible each grasp reaches, where a search has bounded what is possible."""

from collections.abc import Iterable

from scenes.drawing.pages import number
from sim_validate.records.best import Possible
from sim_validate.reports.agreement import Record

MILLI, PERCENT = 1e3, 100.0
ROWS = 20
"""Largest number of grasps in the table of the first page."""
MEASURES = {
    "ferrari-canny": ("Ferrari-Canny quality", " N"),
    "weight": ("weight held in every orientation, for normal forces of sum 1 N", " N"),
    "task": ("multiple of the task's loads, for normal forces of sum 1 N", ""),
}
"""What each measure says of a grasp, and its unit."""


def described_possible(possible: Possible | None) -> Record | None:
    """Build the section of the first page; None where nothing was bounded."""
    if possible is None:
        return None
    what, unit = MEASURES[possible.measure]
    ranked = sorted(possible.reached.items(), key=lambda each: (-each[1], each[0]))
    return {
        "said": (
            f"Best is {possible.best}: {number(possible.reached[possible.best])}{unit} of "
            f"{what}. No four contacts at least {number(MILLI * possible.clearance_m)} mm from "
            f"edges exceed {number(possible.bound)}{unit} at friction {number(possible.friction)}, "
            f"{_proved(possible)}; {PERCENT * possible.gap:.1f} % are between the two."
        ),
        "what": f"{what}{f' [{unit.strip()}]' if unit else ''}",
        "rows": [
            (name, number(value), f"{PERCENT * value / possible.bound:.1f}")
            for name, value in ranked[:ROWS]
        ],
        "more": max(0, len(ranked) - ROWS),
    }


def _proved(possible: Possible) -> str:
    """Say where the proof of the bound is."""
    return f"by the proof in {possible.proof}" if possible.proof else "whose proof was not kept"


def possible_facts(possible: Possible | None, grasp: str) -> Iterable[tuple[str, str, str]]:
    """Yield name, value and meaning of the share of the possible that a grasp reaches."""
    share = None if possible is None else possible.share(grasp)
    if possible is None or share is None:
        return
    what, unit = MEASURES[possible.measure]
    yield (
        "Share of the possible", f"{PERCENT * share:.1f} %",
        f"{what}, over the bound {number(possible.bound)}{unit} for all contacts "
        f"at least {number(MILLI * possible.clearance_m)} mm from edges; grasps nearer to edges "
        "may exceed it",
    )  # fmt: skip
