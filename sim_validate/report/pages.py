"""Writes the pages of a report: the first one, with all runs, and one about each grasp.

The templates include those of single drawings.
"""

import math
import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, cast

import numpy as np

from grasp_core.arrays import Array
from grasp_core.cones.spanning import angles_between
from grasp_core.figures import figures, table
from grasp_core.files.records import record_of
from grasp_core.objects.standard_order import Copies, copies_of
from grasp_core.provenance import versions
from grasp_core.values import Grasp
from scenes.drawing import pages
from scenes.drawing.pages import NOTHING, Fact, as_text, grasp_data, grasp_facts, number
from scenes.drawing.sheets import night_style, svg_of
from sim_validate.closure.verdict import Verdict, WrenchVerdict
from sim_validate.planning.asked_objects import GRASPS
from sim_validate.planning.best import MEASURES, Best, Rated
from sim_validate.protocols.verdict import Totals
from sim_validate.report import sections
from sim_validate.report.agreement import (
    BAD,
    GOOD,
    Record,
    as_predicted,
    frictions_in,
    limits_in,
    quadrants_in,
    said_of_execution,
    wrench_size,
)
from sim_validate.report.charts import fidelity_panel
from sim_validate.report.drawn_grasps import Drawn, largest_push
from sim_validate.report.run_folder import RunFolder, about_grasp

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


MILLI, MICRO, PERCENT = 1e3, 1e6, 100.0
ROTATED, MIRRORED = "rotated", "mirrored"
"""Kinds of copies of a grasp, as the pages call them."""
FAMILIES = {
    "concurrent": "the lines of force meet in one point",
    "pencil": "two pairs of lines, which meet in points of a common line",
    "regulus": "the lines of force are skew and lie on one ruled surface",
}
SPAN = (
    "half-angle of the widest cones around the normals of which any choice of directions "
    "positively spans space; 0: none do, and the force cones lean"
)
TRIAL_FIGURES = tuple(each for each in figures(WrenchVerdict) if each.name != "outcome")
"""Figures of a trial in the columns behind its outcome."""
SAID_ABOVE = ("id", "outcome", "predicted_critical_friction", "simulated_critical_friction")
"""Figures of a verdict that the page says in other places."""
FOCUS = "where lines of force meet, in the object's frame"


@dataclass(frozen=True, slots=True)
class Copy:
    """A grasp that a symmetry of the object makes from another."""

    id: str
    page: str
    """Path of its page, relative to the report's folder."""
    kind: str
    """`ROTATED`, or `MIRRORED` if only a reflection makes it."""


def grasp_page(
    run: RunFolder, grasp: Grasp, object_script: str, drawn: Drawn | None = None, *,
    neighbours: tuple[str | None, str | None] = (None, None), copies: Sequence[Copy] = (),
    first: Copy | None = None,
) -> str:  # fmt: skip
    """Write the text of the page about one grasp.

    It leads to the pages before and after it. A grasp that is drawn has copies by symmetry; of
    these, `first` is the one that is drawn, with the kind of this copy.
    """
    verdict, shown = run.verdict(grasp.id), run.shown(grasp)
    said, tone = run.said(grasp.id)
    size = None if verdict is None else verdict.scale.grasp_size_m
    return page(
        "grasp.html",
        grasp=grasp,
        object=run.saved.body.name,
        notes=run.saved.body.notes,
        friction=run.friction,
        verdict=verdict,
        verdict_text=said,
        tone=tone,
        before=neighbours[0],
        after=neighbours[1],
        copies=copies,
        first=first,
        drawn=drawn,
        push=largest_push(verdict),
        executed=sections.execution_section(run, grasp.id),
        reached=sections.reach_section(run.reaches, grasp),
        executed_clips=drawn.executed if drawn else (),
        object_script=object_script,
        facts=list(_facts(run, grasp, verdict)),
        contacts=list(_contacts(shown)),
        run=run,
        certified=about_grasp(run.certified, grasp.id),
        sizes={  # by which torques are divided: the object's radius, the grasp's size
            "object": f"{number(MILLI * run.saved.body.radius, 3)} mm",
            "grasp": NOTHING if size is None else f"{number(MILLI * size, 3)} mm",
        },
        trial_columns=[(each.shown.heading, each.meaning) for each in TRIAL_FIGURES],
        trials=[] if verdict is None else [_trial(verdict, each) for each in verdict.wrenches],
        commands=list(_commands(run, grasp, verdict)),
        drawing=as_text(
            grasp_data(run.saved.body, shown, run.friction, sections.held_in(run.reaches, grasp))
        ),
    )


def _facts(run: RunFolder, grasp: Grasp, verdict: Verdict | None) -> Iterable[Fact]:
    planned = run.saved.friction
    at_plan = "" if planned == run.friction else f", at friction {planned:g} as planned"
    yield "Family", grasp.family, FAMILIES[grasp.family]
    simulated = None if verdict is None else verdict.simulated_critical_friction
    in_simulation = "" if simulated is None else f", in simulation {number(simulated)}"
    yield from grasp_facts(run.saved.body, grasp, at_plan=at_plan, in_simulation=in_simulation)
    yield from possible_facts(run.possible, grasp.id)
    yield "Normals span up to", f"{number(math.degrees(grasp.span_angle))}°", SPAN
    for place, focus in enumerate(grasp.focus_points):
        name = "Point between the lines of pair" if grasp.family == "regulus" else "Focus"
        yield f"{name} {place}", f"({millimetres(focus)}) mm", FOCUS if place == 0 else ""
    if verdict is not None:
        for figure in figures(Verdict):
            if figure.name not in SAID_ABOVE and figure.of(verdict) is not None:
                yield figure.shown.heading, figure.cell(verdict), figure.meaning
        if (repeats := verdict.robustness) is not None:
            low, high = repeats.interval
            said = f"held {repeats.held} of {len(repeats.trials)} times"
            yield "With noise", said, f"95 % interval of the share held: {low:.2f} to {high:.2f}"


def possible_facts(best: Best | None, grasp: str) -> Iterable[Fact]:
    """Yield the share that a grasp reaches of what a search has bounded."""
    share = None if best is None else best.shares.get(grasp)
    if best is None or share is None:
        return
    what, unit = MEASURES[best.measure]
    yield (
        "Share of the possible", f"{PERCENT * share:.1f} %",
        f"{what}, over the bound {number(best.bound)}{unit} for all contacts "
        f"at least {number(MILLI * best.clearance_m)} mm from edges; grasps nearer to edges "
        "may exceed it",
    )  # fmt: skip


def _contacts(grasp: Grasp) -> Iterable[Record]:
    for face, contact, cone, region in zip(
        grasp.faces, grasp.contacts, grasp.force_cones, grasp.regions, strict=True
    ):
        lean = math.degrees(float(angles_between(cone.axis, contact.normal)))
        half = math.degrees(cone.half_angle)
        yield {
            "face": face,
            "position": millimetres(contact.position),
            "normal": ", ".join(f"{part + 0.0:.3f}" for part in np.round(contact.normal, 3)),
            "cone": f"{half:.1f}°, leans {lean:.1f}°",
            "region": region.kind,
            "disc": NOTHING if region.kind == "point" else number(MILLI * region.inscribed_radius),
        }


def _trial(verdict: Verdict, trial: WrenchVerdict) -> Record:
    size, limit, found = wrench_size(verdict, trial), trial.predicted_limit, trial.simulated_limit
    return {
        "name": trial.name,
        "wrench": ", ".join(f"{part + 0.0:.3g}" for part in trial.wrench),
        "share": "" if not limit else f"{100.0 / limit:.0f} %",
        "limit": number(size * limit if math.isfinite(limit) else None),
        "simulated": number(None if found is None else size * found),
        "friction": number(trial.required_friction, 3),
        "outcome": trial.hold.outcome.value.replace("_", " "),
        "tone": GOOD if as_predicted(trial) else BAD,
        "figures": [each.cell(trial) for each in TRIAL_FIGURES],
    }


def _commands(run: RunFolder, grasp: Grasp, verdict: Verdict | None) -> Iterable[str]:
    asked = f"--grasp {shlex.quote(grasp.id)}"
    other = "" if run.friction == run.saved.friction else f" --friction {run.friction:g}"
    yield f"graspproof view {GRASPS} {asked}{other}"
    if verdict is not None:
        yield f"graspproof replay . {asked} --out replay"
        for name in (each.control.name for each in verdict.controls):
            yield f"graspproof replay . {asked} --control {shlex.quote(name)} --out replay"
    if run.executions is not None and grasp.id in run.executions:
        yield sections.execute_command(run.executions, GRASPS, grasp.id)
    yield from sections.reach_commands(run.reaches, grasp, GRASPS)


def millimetres(point: Array) -> str:
    """Write a point for people, to hundredths of millimetres."""
    return ", ".join(f"{part + 0.0:.2f}" for part in np.round(MILLI * point, 2))


ROWS = 20


@dataclass(frozen=True, slots=True)
class Card:
    """A card in the gallery of the first page: a grasp, and its copies by symmetry."""

    run: RunFolder
    grasp: Grasp
    script: str
    """Name of the script with the object's drawing."""
    page: str
    """Path of the grasp's page, relative to the report's folder, as that of the picture."""
    copies: tuple[Copy, ...] = ()
    picture: str = ""
    """Path of the picture; empty until it is drawn."""


def cards_of(run: RunFolder) -> tuple[Copies, ...]:
    """Sort the grasps of a run into cards: each is a grasp and those that symmetries make of it.

    Only grasps whose tests ended alike share a card, so that no problem is hidden behind another
    grasp.

    Gives places of the grasps in the run, by card, in the order of the cards' first grasps.
    """
    grasps = run.saved.grasps
    ended: dict[object, list[int]] = {}
    for place, grasp in enumerate(grasps):
        executed = said_of_execution(run.executed(grasp.id)) if run.executions else None
        reached = sections.said_of_reach(run.reaches, grasp)[0]
        ended.setdefault((run.said(grasp.id), executed, reached), []).append(place)
    cards = list[Copies]()
    for places in ended.values():
        for card in copies_of(run.saved.body, [grasps[place] for place in places]):
            rotated, mirrored = (
                tuple(places[each] for each in found) for found in (card.rotated, card.mirrored)
            )
            cards.append(Copies(places[card.first], rotated, mirrored))
    return tuple(sorted(cards, key=lambda card: card.first))


def index_page(runs: Sequence[RunFolder], shown: Sequence[Card], waiting: int = 0) -> str:
    """Write the text of the report's first page."""
    verdicts = [verdict for run in runs for verdict in run.tested or ()]
    executed = [run.executions for run in runs if run.executions and run.executions.grasps]
    cards = [_card(each) for each in shown]
    frictions, limits = frictions_in(verdicts), limits_in(verdicts)
    found = [frictions, limits] if limits.pairs else [frictions]
    return page(
        "index.html",
        names=", ".join(dict.fromkeys(run.saved.body.name for run in runs)),
        runs=runs,
        reached=[sections.described_reaches(run.reaches) for run in runs],
        about=[list(_about(run)) for run in runs],
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
        executions=[sections.described_executions(each) for each in executed],
        executed_columns=[
            (each.shown.heading, each.meaning) for each in sections.execution_figures()
        ],
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


def _card(shown: Card) -> dict[str, Any]:
    grasp, verdict = shown.grasp, shown.run.verdict(shown.grasp.id)
    said, tone = shown.run.said(grasp.id)
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
        "executed": sections.execution_row(shown.run.executed(grasp.id))
        if shown.run.executions
        else None,
        "reached": sections.said_of_reach(shown.run.reaches, grasp) if shown.run.reaches else None,
        "weakest": None if verdict is None else _weakest(verdict),
        "by_hand": sections.held_by_hand(shown.run.reaches, grasp),
    }


def _weakest(verdict: Verdict) -> float | None:
    """Find the smallest wrench limit of a grasp [N], with torques divided by the grasp's size."""
    found = [trial.predicted_limit * wrench_size(verdict, trial) for trial in verdict.wrenches]
    return min(filter(math.isfinite, found), default=None)


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
        yield from sections.reach_settings(run.reaches)
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
