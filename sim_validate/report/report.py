"""Turns the folder of a run into a folder of pages that open from disk and need no network."""

import math
import shlex
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, islice
from pathlib import Path
from typing import Any, cast

import numpy as np

from grasp_core.allowed_values import Count, Number, function, path_of, value_of
from grasp_core.arrays import Array
from grasp_core.cones.spanning import angles_between
from grasp_core.figures import figures, table
from grasp_core.files.file_kinds import GRASPS
from grasp_core.files.records import record_of
from grasp_core.files.text_files import write_text
from grasp_core.messages import MILLI
from grasp_core.provenance import versions
from grasp_core.values import Grasp
from scenes.drawing.pages import (
    BAD_TONE,
    GOOD_TONE,
    NO_VALUE,
    Fact,
    TemplateData,
    as_text,
    facts_of,
    filled,
    grasp_data,
    grasp_facts,
    number,
    object_data,
    text_of,
)
from scenes.drawing.pictures import Drawing
from scenes.drawing.sheets import night_style, svg_of
from sim_validate.closure.verdict import Verdict, WrenchVerdict
from sim_validate.files import results_folder
from sim_validate.planning.best import MEASURES, Best, Rated
from sim_validate.processes.workers import available_cores, each
from sim_validate.protocols.verdict import Totals
from sim_validate.report import sections
from sim_validate.report.cards import Card, Paged, cards_to_draw, draw, largest_push
from sim_validate.report.charts import (
    as_predicted,
    fidelity_panel,
    frictions_in,
    limits_in,
    quadrants_in,
    wrench_size,
)
from sim_validate.report.run_folder import Findings, RunFolder, folder_of, runs_in

ASSETS = Path(__file__).parent / "assets"
PERCENT = 100.0
FAMILY_MEANINGS = {
    "concurrent": "the lines of force meet in one point",
    "pencil": "two pairs of lines, which meet in points of a common line",
    "regulus": "the lines of force are skew and lie on one ruled surface",
}
SPAN = (
    "half-angle of the widest cones around the normals of which any choice of directions "
    "positively spans space; 0: none do, and the force cones lean"
)
TRIAL_FIGURES = tuple(each for each in figures(WrenchVerdict) if each.name != "outcome")
TITLE_FIGURES = ("id", "outcome", "predicted_critical_friction", "simulated_critical_friction")
FOCUS_MEANING = "where lines of force meet, in the object's frame"
POSSIBLE_ROWS = 20
FIRST_CARDS = 4
"""Number of cards that are drawn before the first page is written for the first time; it is written
again whenever twice as many are drawn, and at the end."""


def _nothing(*_: object) -> None:
    """Take note of nothing."""


@dataclass(frozen=True, slots=True)
class Report:
    """The paths of a written report."""

    index: Path
    grasps: int
    no_clip: str
    """Reason why clips that were asked for are missing; empty if none is missing."""
    drawn: int


def write_report(
    folder: str | Path,
    out: str | Path | None = None,
    *,
    jobs: int | None = None,
    limit: int | None = None,
    clips: int = 0,
    progress: Callable[[int, int], object] = _nothing,
    ready: Callable[[Path, int, int], object] = _nothing,
) -> Report:
    """Write the results of a run as pages for a browser.

    Every grasp gets a page. Grasps that a symmetry of the object makes from one another share a
    card of the first page and one set of pictures, if their tests ended alike.

    Args:
        folder: Folder of a run, with its grasps.json; or a folder of such folders.
        out: Folder to write to; `report` in the folder if None.
        jobs: Largest number of processes; all cores if None.
        limit: Number of grasps to draw per run, those with problems before others; all if None.
        clips: Number of grasps per run of which trials are filmed, those with problems first, where
            there are graphics.
        progress: Called with (drawn, total) after each card.
        ready: Called with (first page, drawn, total) when the first page can be opened while more
            cards are drawn; not where an earlier report stays until the new one is complete.

    Returns:
        The paths of the report, and why clips are missing.

    Raises:
        InputError: The folder holds no run, a file in it is invalid, or the folder for the pages
            holds other files.
    """
    folder = folder_of(path_of(folder, "folder"))
    out = folder / results_folder.REPORT if out is None else path_of(out, "out")
    for name, value in (("jobs", jobs), ("limit", limit)):
        if value is not None:
            value_of(Count, value, name)
    value_of(Number, clips, "clips")
    function(progress, "progress")
    function(ready, "ready")
    runs = tuple(run.first(limit) for run in runs_in(folder))
    results_folder.require_report_folder(out)
    with results_folder.new_pages(out) as place:
        cards = list(cards_to_draw(runs, clips))
        ready = ready if place == out else _nothing
        report = _written(cards, runs, place, jobs or available_cores(), progress, ready)
    return replace(report, index=out / results_folder.INDEX)


def _written(
    cards: Sequence[Card], runs: Sequence[RunFolder], out: Path, jobs: int,
    progress: Callable[[int, int], object], ready: Callable[[Path, int, int], object],
) -> Report:  # fmt: skip
    for name in results_folder.STATIC:
        rules = (
            f"{night_style()}\n" if name == results_folder.STYLE else ""
        )  # of charts on dark screens
        write_text(out / name, f"{text_of(name, ASSETS)}{rules}")
    for place, run in enumerate(runs):
        data = as_text(object_data(run.saved.body))
        write_text(out / f"object-{place}.js", f"window.graspproofObject = {data};\n")
    tasks = [replace(card, copies=()) for card in cards]
    names = [None, *(f"{card.name}.html" for card in cards), None]
    shown = list[Card]()
    no_clip, next_index = "", min(FIRST_CARDS, len(cards))
    drawing = partial(draw, out)
    results = chain(
        each(drawing, tasks[:FIRST_CARDS], jobs=1), each(drawing, tasks[FIRST_CARDS:], jobs=jobs)
    )
    for card, drawn in zip(cards, results, strict=True):
        around = names[len(shown)], names[len(shown) + 2]
        shown.append(replace(card, drawn=drawn))
        write_text(out / card.page, grasp_page(card.found, shown[-1], around))
        for copy in card.copies:
            write_text(out / copy.page, grasp_page(copy.found, card, copy=copy))
        no_clip = no_clip or drawn.no_clip
        if len(shown) == next_index:
            waiting = len(cards) - len(shown)
            index = write_text(out / results_folder.INDEX, index_page(runs, shown, waiting))
            if next_index == FIRST_CARDS and waiting:
                ready(index, len(shown), len(cards))
            next_index = min(2 * next_index, len(cards))
        progress(len(shown), len(cards))
    grasps = sum(1 + len(card.copies) for card in shown)
    return Report(out / results_folder.INDEX, grasps, no_clip, len(cards))


def grasp_page(
    found: Findings, card: Card, around: tuple[str | None, str | None] = (None, None),
    copy: Paged | None = None,
) -> str:  # fmt: skip
    """Write the text of the page about one grasp: that of a card, or a copy, which has no pictures.

    It leads to the pages before and after it, and from a copy to the grasp that is drawn.
    """
    run, verdict = found.run, found.verdict
    size = None if verdict is None else verdict.scale.grasp_size_m
    return filled(
        "grasp.html",
        ASSETS,
        found=found,
        card=card,
        copy=copy,
        around=around,
        drawn=card.drawn if copy is None else None,
        push=largest_push(verdict),
        executed=sections.execution_section(found),
        reached=sections.reach_section(found),
        facts=list(_facts(found)),
        contacts=list(_contacts(found.shown)),
        sizes={  # by which torques are divided: the object's radius, the grasp's size
            "object": f"{number(MILLI * run.saved.body.radius, 3)} mm",
            "grasp": NO_VALUE if size is None else f"{number(MILLI * size, 3)} mm",
        },
        trial_columns=[(each.shown.heading, each.explained) for each in TRIAL_FIGURES],
        trials=[] if verdict is None else [_trial(verdict, each) for each in verdict.wrenches],
        commands=list(_commands(found)),
        drawing=as_text(grasp_data(Drawing(run.saved.body, found.shown, run.friction, found.held))),
    )


def _facts(found: Findings) -> Iterable[Fact]:
    run, grasp, verdict = found.run, found.grasp, found.verdict
    planned = run.saved.friction
    at_plan = "" if planned == run.friction else f", at friction {planned:g} as planned"
    yield "Family", grasp.family, FAMILY_MEANINGS[grasp.family]
    simulated = None if verdict is None else verdict.simulated_critical_friction
    in_simulation = "" if simulated is None else f", in simulation {number(simulated)}"
    yield from grasp_facts(run.saved.body, grasp, at_plan=at_plan, in_simulation=in_simulation)
    yield from possible_facts(run.possible, grasp.id)
    yield "Normals span up to", f"{number(math.degrees(grasp.span_angle))}°", SPAN
    for place, focus in enumerate(grasp.focus_points):
        name = "Point between the lines of pair" if grasp.family == "regulus" else "Focus"
        yield f"{name} {place}", f"({millimetres(focus)}) mm", FOCUS_MEANING if place == 0 else ""
    if verdict is not None:
        yield from facts_of(verdict, TITLE_FIGURES)
        if (repeats := verdict.robustness) is not None:
            low, high = repeats.interval
            said = f"held {repeats.held} of {len(repeats.trials)} times"
            yield "With noise", said, f"95 % interval of the share held: {low:.2f} to {high:.2f}"


def possible_facts(best: Best | None, grasp: str) -> Iterable[Fact]:
    """Yield the share that a grasp reaches of what a search has bounded."""
    share = None if best is None else best.shares.get(grasp)
    if best is None or share is None:
        return
    _, what, unit = MEASURES[best.measure]
    yield (
        "Share of the possible", f"{PERCENT * share:.1f} %",
        f"{what}, over the bound {number(best.bound)}{unit} for all contacts "
        f"at least {number(MILLI * best.clearance_m)} mm from edges; grasps nearer to edges "
        "may exceed it",
    )  # fmt: skip


def _contacts(grasp: Grasp) -> Iterable[TemplateData]:
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
            "disc": NO_VALUE if region.kind == "point" else number(MILLI * region.inscribed_radius),
        }


def _trial(verdict: Verdict, trial: WrenchVerdict) -> TemplateData:
    size, limit, found = wrench_size(verdict, trial), trial.predicted_limit, trial.simulated_limit
    return {
        "name": trial.name,
        "wrench": ", ".join(f"{part + 0.0:.3g}" for part in trial.wrench),
        "share": "" if not limit else f"{100.0 / limit:.0f} %",
        "limit": number(size * limit if math.isfinite(limit) else None),
        "simulated": number(None if found is None else size * found),
        "friction": number(trial.required_friction, 3),
        "outcome": trial.hold.outcome.value.replace("_", " "),
        "tone": GOOD_TONE if as_predicted(trial) else BAD_TONE,
        "figures": [each.cell(trial) for each in TRIAL_FIGURES],
    }


def _commands(found: Findings) -> Iterable[str]:
    run, grasp = found.run, found.grasp
    asked = f"--grasp {shlex.quote(grasp.id)}"
    other = "" if run.friction == run.saved.friction else f" --friction {run.friction:g}"
    yield f"graspproof view {GRASPS} {asked}{other}"
    if found.verdict is not None:
        yield f"graspproof replay . {asked} --out replay"
        for name in (each.control.name for each in found.verdict.controls):
            yield f"graspproof replay . {asked} --control {shlex.quote(name)} --out replay"
    if run.executions is not None and found.executed is not None:
        yield sections.execute_command(run.executions, GRASPS, grasp.id)
    yield from sections.reach_commands(found, GRASPS)


def millimetres(point: Array) -> str:
    """Write a point for people, to hundredths of millimetres."""
    return ", ".join(f"{part + 0.0:.2f}" for part in np.round(MILLI * point, 2))


def index_page(runs: Sequence[RunFolder], shown: Sequence[Card], waiting: int = 0) -> str:
    """Write the text of the report's first page."""
    verdicts = [verdict for run in runs for verdict in run.tested or ()]
    executed = [run.executions for run in runs if run.executions and run.executions.grasps]
    cards = [_card(each) for each in shown]
    frictions, limits = frictions_in(verdicts), limits_in(verdicts)
    found = [frictions, limits] if limits.pairs else [frictions]
    return filled(
        "index.html",
        ASSETS,
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
            (each.shown.heading, each.explained) for each in sections.EXECUTION_FIGURES
        ],
        judged=_judged(runs),
        possible=[
            {"object": run.saved.body.name, **_described_possible(run.possible)}
            for run in runs
            if run.possible is not None
        ],
    )  # fmt: skip


def _judged(runs: Sequence[RunFolder]) -> TemplateData | None:
    judged = [(run.saved.body.name, run.judgements) for run in runs if run.judgements is not None]
    totals = [(name, each) for name, found in judged for each in found.summary.values()]
    columns, rows = table([each for _, each in totals], Totals)
    named = [(*row[:1], name, *row[1:]) for (name, _), row in zip(totals, rows, strict=True)]
    return {"columns": (*columns[:1], "object", *columns[1:]), "rows": named} if totals else None


def _described_possible(best: Best) -> TemplateData:
    (_, what, unit), name = MEASURES[best.measure], best.grasp.id
    proved = f"by the proof in {best.proof}" if best.proof else "whose proof was not kept"
    distinct = {each.id: each for each in reversed(best.rated)}
    ranked = sorted(distinct.values(), key=lambda each: (-each.quality[0], each.id))
    columns, rows = table(ranked[:POSSIBLE_ROWS], Rated)
    return {
        "said": (
            f"Best is {name}: {number(best.quality[0])}{unit} of {what}. No four contacts at "
            f"least {number(MILLI * best.clearance_m)} mm from edges exceed "
            f"{number(best.bound)}{unit} at friction {number(best.friction)}, {proved}; "
            f"{PERCENT * best.gap:.1f} % are between the two."
        ),
        "columns": columns,
        "rows": rows,
        "more": max(0, len(ranked) - POSSIBLE_ROWS),
    }


def _card(card: Card) -> dict[str, Any]:
    found, run, grasp = card.found, card.found.run, card.found.grasp
    said, tone = found.said
    simulated = None if found.reached is None else found.reached.simulated
    return {
        "grasp": grasp,
        "page": card.page,
        "copies": card.copies,
        "object": run.saved.body.name,
        "family": grasp.family,
        "picture": card.drawn.hand or card.drawn.picture if card.drawn else "",
        "verdict": said,
        "tone": tone,
        "radius_mm": round(MILLI * grasp.radius, 6),
        "share": run.possible.shares.get(grasp.id) if run.possible else None,
        "executed": sections.execution_row(found.executed) if run.executions else None,
        "reached": sections.said_of_reach(found) if run.reaches else None,
        "weakest": None if found.verdict is None else _weakest(found.verdict),
        "by_hand": None if simulated is None else simulated.weakest_n,
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
    for name, value in tables.items():
        if isinstance(value, dict):
            yield from _lines(cast("Mapping[str, Any]", value), f"{where}{name}.")
        else:
            yield f"{where}{name}", str(value)


def _controls(verdicts: Sequence[Verdict]) -> list[dict[str, Any]]:
    kinds = dict[str, dict[str, Any]]()
    for verdict in verdicts:
        for control in verdict.controls:
            name = control.control.name.replace("_", " ")
            kind = kinds.setdefault(name, {"name": name, "let_go": 0, "held": 0, "undecided": 0})
            kind["let_go" if control.let_go else "held" if control.held else "undecided"] += 1
    return list(kinds.values())
