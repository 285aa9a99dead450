"""Writes the page about one grasp: what was found about it, and its pictures."""

import math
import shlex
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array
from grasp_core.cones.spanning import angles_between
from grasp_core.figures import figures
from grasp_core.values import Grasp
from scenes.drawing.pages import NOTHING, Fact, as_text, grasp_data, grasp_facts, number
from sim_validate.closure.controls import ControlVerdict
from sim_validate.closure.verdict import Verdict, WrenchVerdict
from sim_validate.planning.asked_objects import GRASPS
from sim_validate.planning.best_json import MEASURES, Best
from sim_validate.report.agreement import BAD, GOOD, Record, as_predicted, wrench_size
from sim_validate.report.drawn_grasps import Drawn, certified, largest_push
from sim_validate.report.executed_grasps import execute_command, execution_section, said_of_both
from sim_validate.report.pages import page
from sim_validate.report.reached_grasps import held_in, reach_commands, reach_section
from sim_validate.report.run_folder import RunFolder

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
    verdict = run.verdicts.get(grasp.id)
    shown = certified(grasp, run.shaded.get(grasp.id))
    said, tone = said_of_both(verdict, run.executions, run.executed(grasp.id))
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
        executed=execution_section(run.executions, run.executed(grasp.id)),
        reached=reach_section(run.reaches, grasp),
        executed_clips=drawn.executed if drawn else (),
        object_script=object_script,
        facts=list(_facts(run, grasp, verdict)),
        contacts=list(_contacts(shown)),
        certified=_certified(run, grasp),
        sizes={  # by which torques are divided: the object's radius, the grasp's size
            "object": f"{number(MILLI * run.saved.body.radius, 3)} mm",
            "grasp": NOTHING if size is None else f"{number(MILLI * size, 3)} mm",
        },
        trial_columns=[(each.shown.heading, each.meaning) for each in TRIAL_FIGURES],
        trials=[] if verdict is None else [_trial(verdict, each) for each in verdict.wrenches],
        controls=[] if verdict is None else [_control(each) for each in verdict.controls],
        commands=list(_commands(run, grasp, verdict)),
        drawing=as_text(
            grasp_data(run.saved.body, shown, run.friction, held_in(run.reaches, grasp))
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


def _certified(run: RunFolder, grasp: Grasp) -> str:
    found = run.regions.get(grasp.id)
    if run.certified is None or found is None:
        return ""
    friction = f"{run.certified.friction:g}"
    if not run.shaded:
        return f"Certified regions are for friction {friction}: not shown."
    if found.regions is None:
        return f"No certified regions: {found.reason}."
    where = f" Proof: {found.proof.file}." if found.proof else ""
    discs = number(MILLI * found.disc_radius_m) if found.disc_radius_m is not None else NOTHING
    return f"Regions are certified for friction {friction}: discs of {discs} mm.{where}"


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


def _control(each: ControlVerdict) -> Record:
    ended = (f"{trial.name}: {trial.hold.outcome.value}" for trial in each.tried)
    return {
        "name": each.control.name.replace("_", " "),
        "friction": number(each.control.friction),
        "outcomes": ", ".join(ended).replace("_", " "),
        "tone": GOOD if each.let_go else BAD,
        "said": "let go" if each.let_go else "held" if each.held else "undecided",
    }


def _commands(run: RunFolder, grasp: Grasp, verdict: Verdict | None) -> Iterable[str]:
    asked = f"--grasp {shlex.quote(grasp.id)}"
    other = "" if run.friction == run.saved.friction else f" --friction {run.friction:g}"
    yield f"graspproof view {GRASPS} {asked}{other}"
    if verdict is not None:
        yield f"graspproof replay . {asked} --out replay"
        for name in (each.control.name for each in verdict.controls):
            yield f"graspproof replay . {asked} --control {shlex.quote(name)} --out replay"
    if run.executions is not None and run.executed(grasp.id) is not None:
        yield execute_command(run.executions, GRASPS, grasp.id)
    yield from reach_commands(run.reaches, grasp, GRASPS)


def millimetres(point: Array) -> str:
    """Write a point for people, to hundredths of millimetres."""
    return ", ".join(f"{part + 0.0:.2f}" for part in np.round(MILLI * point, 2))
