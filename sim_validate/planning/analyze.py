"""Runs the command `analyze`, which judges contacts of any origin and prints tables or JSON.

A question that cannot be decided leaves a reason; all other questions are still answered.
"""

import math
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import partial
from typing import Annotated, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike
from pydantic import computed_field

from grasp_core.allowed_values import FLAT, Count, Null, OrInfinity, Quantity, Share
from grasp_core.arrays import Array, Shape, Wrench, to_digits
from grasp_core.closure.closure_certificate import FAR_BELOW, ClosureCertificate
from grasp_core.closure.contacts import contact_torsions
from grasp_core.closure.critical_friction import critical_friction, critical_friction_interval
from grasp_core.closure.force_closure import force_closure
from grasp_core.closure.friction_interval import FrictionInterval
from grasp_core.closure.wrench_sets import Norm
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError, NoForcesError, SolverError, UndecidedError, about
from grasp_core.figures import NONE, Shown, cell, figures
from grasp_core.files.file_kinds import ANALYSES
from grasp_core.files.text_files import read_text
from grasp_core.planning.grasps_json import ContactSet, Overrides, contact_sets_from_json
from grasp_core.quality.contact_forces import contact_forces
from grasp_core.quality.ferrari_canny import FerrariCanny, ferrari_canny
from grasp_core.quality.metrics import hull_volume, min_weight, smallest_singular_value
from grasp_core.quality.wrench_limits import axis_wrenches, wrench_limits
from grasp_core.solvers.ties import first_best
from sim_validate.commands import flags
from sim_validate.commands.console import TABLE_ROWS, Reporter
from sim_validate.commands.exit_codes import Exit
from sim_validate.files.result_files import ResultFile
from sim_validate.processes.workers import each

MOST_HULL_EDGES = 10_000
"""Most edges of all pyramids of a grasp, whose hull in six dimensions then takes ten seconds."""

FIGURE_ROUNDING = 1e-12
"""Size up to which figures of unit size come from rounding."""
HARDLY = 1e-9
"""Share of the largest normal force below which what contacts resist comes from rounding."""
NO_BALANCE = "no balance"
"""What stands for the margin of contacts of which hardly any forces balance, or none."""
OF_HARD = "min-weight, hull volume, singular value, the lower end of mu*, least-norm forces"
"""Figures that are not defined here for soft fingertips, in words."""

Analysed = TypeVar("Analysed")
CheckedProof = TypeVar("CheckedProof", ClosureCertificate, FrictionInterval)
Forces = Annotated[Array, Shape(None, 3)]
Margin = Annotated[float, Null(-math.inf)]
ProvedBounds = tuple[float, float]
"""Proved lower and upper bound."""


class ClosureAnswer(StrEnum):
    """What was decided about force closure."""

    CLOSED = "closed"
    OPEN = "open"
    UNDECIDED = "undecided"


@declared
class Question(Declared):
    """Which questions to answer about contacts, with their settings."""

    max_normal_force_n: Quantity
    """Largest normal force of each contact [N]."""
    wrenches: tuple[tuple[float, float, float, float, float, float], ...] = ()
    """External wrenches (force, torque) [N, N m], torque about each grasp's centre."""
    edges: Count = 8
    """Number of edges of the pyramids that stand for friction cones in metrics defined by them."""
    torsion_m: Share = 0.0
    """Torsional coefficient of every contact [m]; zero is a hard fingertip."""

    @property
    def soft(self) -> dict[str, Any]:
        """The argument for soft fingertips, of functions that know them; empty for hard ones."""
        return {"torsion_m": self.torsion_m} if self.torsion_m else {}


@declared
class Resisted(Declared):
    """The largest multiple of a wrench that is resisted, and forces that balance the wrench."""

    wrench: Wrench
    limit: OrInfinity
    """Largest multiple that is resisted."""
    upper: OrInfinity
    """Multiple above which the wrench is not resisted."""
    least_norm_forces_n: Forces | None = None
    """The balancing forces of least norm, in pyramids inscribed in the friction cones, (k, 3) [N];
    None if there are none, which may happen for a limit just above 1, if none were asked for, or
    with torsion."""


@declared
class Analysis(Declared):
    """Results about one grasp; None stands for a result that could not be decided."""

    contacts: Annotated[ContactSet, FLAT]
    closed: Annotated[bool | None, Shown("closed")]
    """Whether the contacts are in force closure, by a certificate that was checked again."""
    closure_margin: Annotated[
        Margin | None,
        Shown("margin", infinite=NO_BALANCE, rounding=FIGURE_ROUNDING, least=FAR_BELOW),
    ]
    """Proved margin of force closure; -1e6 stands for smaller ones, too."""
    forces: Forces | None
    """Balancing forces that prove closure."""
    separating_wrench: Wrench | None
    """Wrench that proves that there is no closure, with its torque about the grasp's centre."""
    critical_friction: Annotated[OrInfinity | None, Shown("mu*", ".4f")]
    """Common coefficient that suffices for closure; infinite if none does."""
    critical_friction_interval: tuple[OrInfinity, OrInfinity] | None
    """Ends between which it is proved to lie, checked again in rational arithmetic; None with
    torsion."""
    ferrari_canny_l1_n: Annotated[ProvedBounds | None, Shown("l1 N", rounding=FIGURE_ROUNDING)]
    ferrari_canny_linf_n: Annotated[ProvedBounds | None, Shown("linf N", rounding=FIGURE_ROUNDING)]
    verified: Mapping[str, bool]
    """Whether plain arithmetic has confirmed closure and the bounds of both qualities, by name."""
    min_weight: Annotated[
        Margin | None, Shown("min-weight", infinite=NO_BALANCE, rounding=FIGURE_ROUNDING)
    ]
    hull_volume: Annotated[float | None, Shown("hull volume")]
    smallest_singular_value: Annotated[
        float | None, Shown("singular value", rounding=FIGURE_ROUNDING)
    ]
    weakest_axis_wrench: Resisted | None
    """The wrench along an axis that is resisted least, and its limit."""
    resisted_in_every_direction_n: Annotated[float | None, Shown("every direction N")]
    """Multiple up to which the grasp resists every wrench of unit size."""
    wrenches: tuple[Resisted | None, ...]
    """Results about the wrenches, in the order in which they were asked about."""
    undecided: Mapping[str, str]
    """Reasons why questions could not be decided, by the name of the question."""
    torques: Annotated[Array, Shape(None)] | None = None
    """Torques about the inward normals that balance with the forces, (k,) [m]; None without torsion
    or closure."""

    @computed_field
    @property
    def outcome(self) -> ClosureAnswer:
        """The answer about force closure."""
        if self.closed is None:
            return ClosureAnswer.UNDECIDED
        return ClosureAnswer.CLOSED if self.closed else ClosureAnswer.OPEN

    @computed_field
    @property
    def weakest_axis(self) -> Annotated[OrInfinity | None, Shown("weakest axis")]:
        """Largest multiple that is resisted of the wrench along the weakest axis."""
        return None if self.weakest_axis_wrench is None else self.weakest_axis_wrench.limit


@declared
class Analyses(ResultFile):
    """The analyses of all grasps of a contacts file."""

    FILE = ANALYSES
    SCHEMA = 1

    source: str
    """Path of the file."""
    question: Annotated[Question, FLAT]
    grasps: tuple[Analysis, ...]
    complete: bool

    @computed_field
    @property
    def summary(self) -> Mapping[str, int]:
        """Numbers of grasps, and of grasps of each outcome."""
        counts = Counter(each.outcome for each in self.grasps)
        return {"grasps": len(self.grasps)} | {each.value: counts[each] for each in ClosureAnswer}


def analyze(contacts: ContactSet, question: Question) -> Analysis:
    """Answer every question about one grasp that can be decided."""
    given, soft = (contacts.positions, contacts.normals, contacts.friction), question.soft
    ask = _Asking()
    l1 = ask("ferrari_canny_l1", lambda: _quality(contacts, "l1", soft))
    linf = ask("ferrari_canny_linf", lambda: _quality(contacts, "linf", soft))
    proof = ask("closure", lambda: _checked(force_closure(*given, **soft)))
    critical, interval = ask("critical_friction", lambda: _critical(contacts, soft)) or (None, None)
    bounds = [None if found is None else (found.lower, found.upper) for found in (l1, linf)]
    return Analysis(
        contacts=contacts,
        closed=None if proof is None else proof.closed,
        closure_margin=None if proof is None else proof.margin,
        forces=None if proof is None else proof.forces,
        separating_wrench=_about_center(proof, contacts.center),
        critical_friction=critical,
        critical_friction_interval=interval,
        ferrari_canny_l1_n=bounds[0],
        ferrari_canny_linf_n=bounds[1],
        verified={
            "closure": proof is not None,
            "ferrari_canny_l1_n": l1 is not None and l1.verify(),
            "ferrari_canny_linf_n": linf is not None and linf.verify(),
        },
        **_of_hard(contacts, question, ask),
        weakest_axis_wrench=ask("weakest_axis_wrench", lambda: _weakest_axis(contacts, question)),
        resisted_in_every_direction_n=(
            None if linf is None else max(0.0, linf.lower) * question.max_normal_force_n
        ),
        wrenches=tuple(
            ask(f"wrenches[{i}]", lambda load=load: _resisted(contacts, load, question))
            for i, load in enumerate(question.wrenches)
        ),
        undecided=ask.reasons,
        torques=None if proof is None else proof.torques,
    )


def _of_hard(contacts: ContactSet, question: Question, ask: "_Asking") -> dict[str, float | None]:
    """Return the figures that are defined for hard fingertips only, None for soft ones."""
    if question.soft:
        return dict.fromkeys(("min_weight", "hull_volume", "smallest_singular_value"))
    given, edges = (contacts.positions, contacts.normals, contacts.friction), question.edges
    measured: dict[str, Any] = {"center": contacts.center, "torque_scale": contacts.torque_scale}
    return {
        "min_weight": ask("min_weight", lambda: min_weight(*given, edges=edges)),
        "hull_volume": ask("hull_volume", lambda: hull_volume(*given, edges=edges, **measured)),
        "smallest_singular_value": smallest_singular_value(given[0], **measured),
    }


@dataclass(slots=True)
class _Asking:
    """Answers questions about one grasp, and keeps the reasons why some have no answer."""

    reasons: dict[str, str] = field(default_factory=dict[str, str])

    def __call__(self, name: str, question: Callable[[], Analysed]) -> Analysed | None:
        try:
            return question()
        except (UndecidedError, SolverError) as error:
            self.reasons[name] = str(error)
            return None


def _checked(certificate: CheckedProof) -> CheckedProof:
    if not certificate.verify():
        raise UndecidedError(
            "the answer's own certificate failed its check, so the answer cannot be trusted"
        )
    return certificate


def _about_center(proof: ClosureCertificate | None, center: Array) -> Array | None:
    """Return a certificate's separating wrench with its torque about a grasp's centre, (6,)."""
    wrench = None if proof is None else proof.separating_wrench
    if wrench is None:
        return None
    return np.concatenate([wrench[:3] + np.cross(wrench[3:], center), wrench[3:]])


def _critical(contacts: ContactSet, soft: dict[str, Any]) -> tuple[float, ProvedBounds | None]:
    """Return the critical friction, and its proved bounds for hard fingertips."""
    given = contacts.positions, contacts.normals
    if soft:
        return critical_friction(*given, **soft), None
    found = _checked(critical_friction_interval(*given))
    return found.critical_friction, (found.lower, found.upper)


def _quality(contacts: ContactSet, norm: Norm, soft: dict[str, Any]) -> FerrariCanny:
    return ferrari_canny(
        contacts.positions, contacts.normals, contacts.friction,
        center=contacts.center, torque_scale=contacts.torque_scale, norm=norm, **soft,
    )  # fmt: skip


def _limits(contacts: ContactSet, wrenches: ArrayLike, question: Question) -> list[Resisted]:
    found = wrench_limits(
        contacts.positions, contacts.normals, contacts.friction, wrenches,
        max_normal_force=question.max_normal_force_n, center=contacts.center, **question.soft,
    )  # fmt: skip
    rounding = [_hardly(each.wrench, contacts, question) for each in found]
    return [
        Resisted(each.wrench, each.limit if each.limit > hardly else 0.0, each.upper)
        for each, hardly in zip(found, rounding, strict=True)
    ]


def _hardly(wrench: Array, contacts: ContactSet, question: Question) -> float:
    """Return the multiple of a wrench below which it is rounding that resists it."""
    largest = float(np.abs(wrench / np.repeat([1.0, contacts.torque_scale], 3)).max())
    return HARDLY * question.max_normal_force_n / largest


def _weakest_axis(contacts: ContactSet, question: Question) -> Resisted:
    limits = _limits(contacts, axis_wrenches(contacts.torque_scale), question)
    return limits[first_best([-found.limit for found in limits])]


def _resisted(contacts: ContactSet, wrench: ArrayLike, question: Question) -> Resisted:
    (limit,) = _limits(contacts, np.array([wrench]), question)
    if limit.upper < 1.0 or question.soft:
        return limit
    try:
        forces = contact_forces(
            contacts.positions, contacts.normals, contacts.friction, wrench,
            normal_force=(0.0, question.max_normal_force_n), center=contacts.center,
        )  # fmt: skip
    except NoForcesError:
        return limit
    return replace(limit, least_norm_forces_n=forces)


PRINTED_DIGITS = 7
PRINTED_STEP = 10.0**-PRINTED_DIGITS
"""Step to which ends of a printed interval are rounded, and to which they are reproducible."""


def analyze_file(command: flags.AnalyzeFlags, reporter: Reporter) -> int:
    """Analyse the grasps of a contacts file; an interrupted run still shows its results so far."""
    overrides = Overrides(command.friction, command.torque_scale_m, command.outward)
    text = read_text(command.contacts)
    with about(command.contacts):
        sets = contact_sets_from_json(text, overrides)
    for contacts in sets:
        count = len(contacts.positions)
        with about(f"{command.contacts}: grasp {contacts.id}"):
            contact_torsions(command.torsion_m, contacts.friction)
        if count * command.edges > MOST_HULL_EDGES:
            raise InputError(
                f"grasp {contacts.id}: {count} contacts with {command.edges} edges each exceed "
                f"{MOST_HULL_EDGES} edges; use --edges {MOST_HULL_EDGES // count} or less"
            )
    question = Question(
        command.max_normal_force_n, command.wrench, command.edges, command.torsion_m
    )
    found = each(partial(analyze, question=question), sets, jobs=command.jobs)

    def told(done: tuple[Analysis, ...], *, complete: bool) -> Analyses:
        analyses = Analyses(str(command.contacts), question, done, complete)
        reporter.document(analyses.document())
        return analyses

    analyses = reporter.collected(
        "analysing",
        found,
        len(sets),
        ("closed", lambda one: one.outcome is ClosureAnswer.CLOSED),
        told,
    )
    _show(analyses, reporter)
    good = all(found.outcome is ClosureAnswer.CLOSED for found in analyses.grasps)
    return Exit.GOOD if good else Exit.NEGATIVE


def _show(analyses: Analyses, reporter: Reporter) -> None:
    shown = analyses.grasps[:TABLE_ROWS]
    if len(analyses.grasps) == 1:
        name = shown[0].contacts.id
        reporter.table(f"grasp {name}", ("property", "value"), _facts(shown[0]))
    else:
        reporter.records(f"{len(analyses.grasps)} grasps", analyses.grasps)
    if shown[0].wrenches:
        rows = [row for found in shown for row in _wrench_rows(found, analyses.question)]
        columns = ("grasp", "wrench", "resisted up to", "upper bound", "least-norm forces N")
        reporter.table("wrenches", columns, rows)
    for found in shown:
        for name, reason in found.undecided.items():
            reporter.say(f"grasp {found.contacts.id}: {name} is undecided: {reason}")
        for name in (name for name, good in found.verified.items() if not good):
            reporter.say(f"grasp {found.contacts.id}: {name} is NOT CHECKED")
    _say_measures(shown[0].contacts, reporter)
    if analyses.question.soft:
        reporter.say(f"left out, because they are computed for hard fingertips only: {OF_HARD}")
    totals = analyses.summary
    reporter.say(
        f"{totals['closed']} of {totals['grasps']} grasps are in force closure, "
        f"{totals['open']} are not, {totals['undecided']} are undecided"
    )


def _say_measures(contacts: ContactSet, reporter: Reporter) -> None:
    """Say which centre and torque scale were used; they are the same for all grasps of a file."""
    centers = {
        "file": "the center_m of the file",
        "mean contact": "the mean contact (no center_m given)",
        "center of mass": "the object's centre of mass",
    }
    scales = {
        "flag": "--torque-scale-m",
        "file": "the torque_scale_m of the file",
        "farthest contact": "the distance of the farthest contact (no torque_scale_m given)",
        "object radius": "the object's radius",
    }
    reporter.say(
        f"torques are about {centers[contacts.center_from]}, and are divided by "
        f"{scales[contacts.torque_scale_from]} to compare them with forces"
    )


def _facts(found: Analysis) -> list[tuple[str, str]]:
    rows = [(figure.shown.heading, figure.cell(found)) for figure in figures(Analysis)[1:]]
    if found.critical_friction_interval is not None:
        rows.append(_proved(*found.critical_friction_interval))
    if found.forces is not None:
        rows.append(("balanced forces", _listed(found.forces)))
    if found.torques is not None:
        rows.append(("balanced torques", _listed(found.torques)))
    if found.separating_wrench is not None:
        rows.append(("separating wrench", _listed(found.separating_wrench)))
    if found.weakest_axis_wrench is not None:
        rows.append(("weakest axis wrench", _listed(found.weakest_axis_wrench.wrench)))
    rows.append(("centre [m]", _listed(found.contacts.center)))
    return [*rows, ("torque scale [m]", f"{found.contacts.torque_scale:.6g}")]


def _wrench_rows(found: Analysis, question: Question) -> list[tuple[str, ...]]:
    rows, name = list[tuple[str, ...]](), found.contacts.id
    for one in found.wrenches:
        if one is None:
            rows.append((name, NONE, NONE, NONE, NONE))
            continue
        zero = _hardly(one.wrench, found.contacts, question)
        shown = Shown("", ".6g", infinite="any multiple", rounding=zero)
        forces = one.least_norm_forces_n
        rows.append((
            name, _listed(one.wrench), cell(one.limit, shown), cell(one.upper, shown),
            NONE if forces is None else _listed(forces),
        ))  # fmt: skip
    return rows


def _proved(lower: float, upper: float) -> tuple[str, str]:
    """Say where mu* is proved to be, with both ends rounded outwards so that it still holds."""
    low, high = (
        np.array([np.floor(lower / PRINTED_STEP), np.ceil(upper / PRINTED_STEP)]) * PRINTED_STEP
    )
    if math.isinf(lower):
        return "mu* is proved", "infinite: no friction is enough"
    if math.isinf(upper):
        return "mu* is proved at least", f"{low:.{PRINTED_DIGITS}f}"
    return "mu* is proved between", f"{low:.{PRINTED_DIGITS}f} and {high:.{PRINTED_DIGITS}f}"


def _listed(values: Array) -> str:
    rows = np.atleast_2d(to_digits(values) + 0.0).tolist()
    return "; ".join(", ".join(f"{value:.4g}" for value in row) for row in rows)
