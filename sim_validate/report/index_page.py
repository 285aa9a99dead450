"""Writes the first page of a report: all runs, and the pictures of their grasps."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any, cast

from grasp_core.figures import table
from grasp_core.files.records import record_of
from grasp_core.objects.symmetries import Copies, copies_of
from grasp_core.provenance import versions
from grasp_core.values import Grasp
from scenes.drawing.pages import number
from scenes.drawing.sheets import svg_of
from sim_validate.closure.verdict import Verdict
from sim_validate.planning.best_json import MEASURES, Best, Rated
from sim_validate.protocols.verdict import Totals
from sim_validate.report.agreement import (
    Record,
    frictions_in,
    limits_in,
    quadrants_in,
    wrench_size,
)
from sim_validate.report.executed_grasps import (
    described_executions,
    execution_figures,
    execution_row,
    said_of_both,
)
from sim_validate.report.grasp_page import MILLI, MIRRORED, PERCENT, Copy
from sim_validate.report.pages import page
from sim_validate.report.reached_grasps import (
    described_reaches,
    held_by_hand,
    reach_settings,
    said_of_reach,
)
from sim_validate.report.run_charts import fidelity_panel
from sim_validate.report.run_folder import RunFolder

ROWS = 20


@dataclass(frozen=True, slots=True)
class Shown:
    """A card in the gallery of the first page: a grasp, and its copies by symmetry."""

    run: RunFolder
    grasp: Grasp
    page: str
    picture: str
    copies: tuple[Copy, ...] = ()


def cards_of(run: RunFolder) -> tuple[Copies, ...]:
    """Sort the grasps of a run into cards: each is a grasp and those that symmetries make of it.

    Only grasps whose tests ended alike share a card, so that no problem is hidden behind another
    grasp.

    Gives places of the grasps in the run, by card, in the order of the cards' first grasps.
    """
    grasps = run.saved.grasps
    ended: dict[object, list[int]] = {}
    for place, grasp in enumerate(grasps):
        found = run.executed(grasp.id)
        said = said_of_both(run.verdicts.get(grasp.id), run.executions, found)
        executed = execution_row(found)["said"] if run.executions else None
        reached = said_of_reach(run.reaches, grasp)[0]
        ended.setdefault((said, executed, reached), []).append(place)
    cards = list[Copies]()
    for places in ended.values():
        for card in copies_of(run.saved.body, [grasps[place] for place in places]):
            rotated, mirrored = (
                tuple(places[each] for each in found) for found in (card.rotated, card.mirrored)
            )
            cards.append(Copies(places[card.first], rotated, mirrored))
    return tuple(sorted(cards, key=lambda card: card.first))


def index_page(runs: Sequence[RunFolder], shown: Sequence[Shown], waiting: int = 0) -> str:
    """Write the text of the report's first page."""
    verdicts = [verdict for run in runs for verdict in run.verdicts.values()]
    executed = [run.executions for run in runs if run.executions and run.executions.grasps]
    cards = [_card(each) for each in shown]
    frictions, limits = frictions_in(verdicts), limits_in(verdicts)
    found = [frictions, limits] if limits.pairs else [frictions]
    return page(
        "index.html",
        names=", ".join(dict.fromkeys(run.saved.body.name for run in runs)),
        runs=[_described(run) for run in runs],
        cards=cards,
        waiting=waiting,
        hands=any(run.reaches is not None for run in runs),
        by_hand=any(card["by_hand"] is not None for card in cards),
        choices={
            name: sorted({str(card[name]) for card in cards})
            for name in ("object", "family", "verdict")
        },
        tried=bool(verdicts),
        quadrants=quadrants_in(verdicts),
        agreements=found,
        fidelity=[svg_of(fidelity_panel(each)) for each in found] if verdicts else [],
        limits=bool(limits.pairs),
        mismatches=[f"{each.id}: {line}" for each in verdicts for line in each.mismatches],
        controls=_controls(verdicts),
        executions=[described_executions(each) for each in executed],
        executed_columns=[(each.shown.heading, each.meaning) for each in execution_figures()],
        judged=_judged(runs),
        possible=[
            {"object": run.saved.body.name, **_described_possible(run.possible)}
            for run in runs
            if run.possible is not None
        ],
    )  # fmt: skip


def _judged(runs: Sequence[RunFolder]) -> Record | None:
    """Return a table of how many grasps each published test accepts, for each object."""
    judged = [(run.saved.body.name, run.judgements) for run in runs if run.judgements is not None]
    totals = [(name, each) for name, found in judged for each in found.summary.values()]
    columns, rows = table([each for _, each in totals], Totals)
    named = [(*row[:1], name, *row[1:]) for (name, _), row in zip(totals, rows, strict=True)]
    return {"columns": (*columns[:1], "object", *columns[1:]), "rows": named} if totals else None


def _described_possible(best: Best) -> Record:
    (what, unit), name = MEASURES[best.measure], best.grasp.id
    proved = f"by the proof in {best.proof}" if best.proof else "whose proof was not kept"
    distinct = {each.id: each for each in reversed(best.rated)}
    ranked = sorted(distinct.values(), key=lambda each: (-each.quality[0], each.id))
    columns, rows = table(ranked[:ROWS], Rated)
    return {
        "said": (
            f"Best is {name}: {number(best.quality[0])}{unit} of {what}. No four contacts at "
            f"least {number(MILLI * best.clearance_m)} mm from edges exceed "
            f"{number(best.bound)}{unit} at friction {number(best.friction)}, {proved}; "
            f"{PERCENT * best.gap:.1f} % are between the two."
        ),
        "columns": columns,
        "rows": rows,
        "more": max(0, len(ranked) - ROWS),
    }


def _card(shown: Shown) -> dict[str, Any]:
    grasp, verdict = shown.grasp, shown.run.verdicts.get(shown.grasp.id)
    executed = shown.run.executed(grasp.id)
    said, tone = said_of_both(verdict, shown.run.executions, executed)
    return {
        "id": grasp.id,
        "object": shown.run.saved.body.name,
        "family": grasp.family,
        "page": shown.page,
        "picture": shown.picture,
        "copies": shown.copies,
        "mirrored": sum(copy.kind == MIRRORED for copy in shown.copies),
        "verdict": said,
        "tone": tone,
        "radius_mm": round(MILLI * grasp.radius, 6),
        "quality": grasp.ferrari_canny[0],
        "share": shown.run.possible.shares.get(grasp.id) if shown.run.possible else None,
        "critical_friction": grasp.critical_friction,
        "executed": execution_row(executed) if shown.run.executions else None,
        "reached": said_of_reach(shown.run.reaches, grasp) if shown.run.reaches else None,
        "weakest": None if verdict is None else _weakest(verdict),
        "by_hand": held_by_hand(shown.run.reaches, grasp),
    }


def _weakest(verdict: Verdict) -> float | None:
    """Find the smallest wrench limit of a grasp [N], with torques divided by the grasp's size."""
    found = [trial.predicted_limit * wrench_size(verdict, trial) for trial in verdict.wrenches]
    return min(filter(math.isfinite, found), default=None)


def _described(run: RunFolder) -> dict[str, Any]:
    tested = run.tested
    said = f"{len(run.saved.grasps) + run.left_out} grasps at friction {run.friction:g}"
    if tested is not None:
        counts = tested.summary
        said += (
            f"; {counts['grasps_held']} of {counts['grasps']} held, "
            f"{counts['controls_let_go']} of {counts['controls']} negative controls were let go, "
            f"{counts['mismatches']} results contradict the analysis"
        )
        said += "" if tested.complete else "; the run was interrupted"
    said += "."
    said += f" {described_reaches(run.reaches)}" if run.reaches else ""
    if run.left_out:
        said += (
            f" {len(run.saved.grasps)} are shown, those with problems among them; "
            "`graspproof report` draws all."
        )
    gate = () if tested is None else tested.gate.checks
    return {
        "name": run.saved.body.name,
        "summary": " ".join([said, *run.saved.body.notes]),
        "about": list(_about(run)),
        "gate": gate,
        "gate_passed": sum(check.passed for check in gate),
    }


def _about(run: RunFolder) -> Iterable[tuple[str, str]]:
    body = run.saved.body
    yield "object", f"{len(body.faces)} faces, radius {MILLI * body.radius:.4g} mm"
    yield "content_sha256", body.content_sha256
    yield "friction", f"{run.friction:g}"
    yield "seed", str(run.saved.seed)
    for first in islice(run.tested or (), 1):
        asked = {"setup": first.setup, "agenda": first.agenda, "scale": first.scale}
        yield from _lines({name: record_of(each) for name, each in asked.items()})
    if run.executions is not None:
        used = {"friction": run.executions.friction, **record_of(run.executions.settings)}
        yield from _lines({"execution": used})
    if run.reaches is not None:
        yield from reach_settings(run.reaches)
    found = versions() if run.tested is None else run.tested.versions
    for name, version in found.items():
        yield f"version of {name}", str(version)


def _lines(tables: Mapping[str, Any], where: str = "") -> Iterator[tuple[str, str]]:
    """Yield each setting in tables inside each other with its place."""
    for name, value in tables.items():
        if isinstance(value, dict):
            yield from _lines(cast("Mapping[str, Any]", value), f"{where}{name}.")
        else:
            yield f"{where}{name}", str(value)


def _controls(verdicts: Sequence[Verdict]) -> list[dict[str, Any]]:
    kinds = dict[str, dict[str, Any]]()
    for control in (each for verdict in verdicts for each in verdict.controls):
        plain = control.control.name.replace("_", " ")
        kind = kinds.setdefault(plain, {"name": plain, "let_go": 0, "held": 0, "undecided": 0})
        kind["let_go" if control.let_go else "held" if control.held else "undecided"] += 1
    return list(kinds.values())
