"""Says how much of the possible each grasp reaches, where a search has bounded what is possible."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from grasp_core.errors import InputError
from grasp_core.files.json_text import object_of, record_of
from grasp_core.files.text_files import read_text
from scenes.drawing.pages import number
from sim_validate.records.best.best_schema import OTHER, USUAL, BestFile, BestForLoadsFile
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


@dataclass(frozen=True, slots=True)
class Possible:
    """The best grasp that a search has found, and the bound that no grasp exceeds."""

    object_sha256: str
    friction: float
    measure: str
    clearance_m: float
    best: str
    """Id of the best grasp."""
    bound: float
    gap: float
    proof: str
    """Name of the file with the proof of the bound; empty if it was not kept."""
    reached: Mapping[str, float]
    """Lower ends of the measure of the best grasp and the planned ones, by id."""

    def share(self, grasp: str) -> float | None:
        """Return how much of the bound a grasp reaches; None if it was not compared."""
        return self.reached[grasp] / self.bound if grasp in self.reached else None


def read_possible(path: Path) -> Possible:
    """Read `best.json`."""
    text = read_text(path)
    schema = object_of(text, path.name).get("schema")
    if schema == OTHER:
        loads = record_of(BestForLoadsFile, text, path.name, schema=OTHER)
        rated = {each["id"]: each["quality"][0] for each in loads["planned"]}
        return _possible(
            cast("Record", loads), loads["measure"], loads["quality"][0], loads["bound"], rated
        )
    found = record_of(BestFile, text, path.name, schema=USUAL)
    rated = {each["id"]: each["quality_n"][0] for each in found["planned"]}
    return _possible(
        cast("Record", found), "ferrari-canny", found["quality_n"][0], found["bound_n"], rated
    )


def _possible(
    found: Record, measure: str, quality: float, bound: float, rated: Mapping[str, float]
) -> Possible:
    name = found["grasp"]["id"]
    if quality > bound:
        raise InputError(
            f"bound: expected at least the quality {quality:g} of {name}, got {bound:g}"
        )
    return Possible(
        found["object"]["content_sha256"], found["friction"], measure, found["clearance_m"], name,
        bound, found["gap"], found["proof"] or "", {**rated, name: quality},
    )  # fmt: skip


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
