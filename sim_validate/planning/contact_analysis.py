"""Analyses given contacts: force closure, critical friction, quality and wrench limits.

A question that cannot be decided leaves a reason; all other questions are still answered.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TypeVar

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.critical_friction import critical_friction_interval
from grasp_core.closure.force_closure import ClosureCertificate, force_closure
from grasp_core.closure.friction_interval import FrictionInterval
from grasp_core.closure.wrench_sets import Norm
from grasp_core.errors import InputError, NoForcesError, SolverError, UndecidedError
from grasp_core.forces.contact_forces import contact_forces
from grasp_core.quality.ferrari_canny import ferrari_canny
from grasp_core.quality.metrics import hull_volume, min_weight, smallest_singular_value
from grasp_core.quality.wrench_limits import WrenchLimit, axis_wrenches, wrench_limits
from grasp_core.records.contacts_json import ContactSet
from grasp_core.solvers.ties import first_best

MOST_EDGES = 10_000
"""Largest number of edges of all pyramids of a grasp together; their hull in six dimensions then
takes ten seconds."""

Answer = TypeVar("Answer")
Checked = TypeVar("Checked", ClosureCertificate, FrictionInterval)
Wrench = tuple[float, float, float, float, float, float]


class Outcome(StrEnum):
    """What was decided about force closure."""

    CLOSED = "closed"
    OPEN = "open"
    UNDECIDED = "undecided"


@dataclass(frozen=True, slots=True)
class Question:
    """Which questions to answer about contacts, with their settings."""

    max_normal_force: float
    """Largest normal force of each contact [N]."""
    wrenches: tuple[Wrench, ...] = ()
    """External wrenches (force, torque) [N, N m], torque about each grasp's centre."""
    edges: int = 8
    """Number of edges of the pyramids that stand for friction cones in metrics defined by them."""


@dataclass(frozen=True, slots=True)
class Bounds:
    """Lower and upper bound of a quality [N], and whether plain arithmetic proved them."""

    lower: float
    upper: float
    verified: bool


@dataclass(frozen=True, slots=True, eq=False)
class Resisted:
    """The largest multiple of a wrench that is resisted, and forces that balance the wrench."""

    limit: WrenchLimit
    forces: Array | None
    """The balancing forces of least norm, in pyramids inscribed in the friction cones, (k, 3) [N];
    None if there are none, which may happen for a limit just above 1."""


@dataclass(frozen=True, slots=True, eq=False)
class Analysis:
    """Results about one grasp; None stands for a result that could not be decided."""

    contacts: ContactSet
    certificate: ClosureCertificate | None
    """The certificate of force closure, checked again in plain arithmetic."""
    friction_interval: FrictionInterval | None
    """Interval of the least common friction for closure, checked again in rational arithmetic."""
    l1: Bounds | None
    linf: Bounds | None
    min_weight: float | None
    hull_volume: float | None
    smallest_singular_value: float
    weakest_axis: WrenchLimit | None
    """The wrench along an axis that is resisted least, and its limit."""
    everywhere: float | None
    """Multiple up to which the grasp resists every wrench of unit size."""
    wrenches: tuple[Resisted | None, ...]
    """Results about the wrenches, in the order in which they were asked about."""
    undecided: dict[str, str]
    """Reasons why questions could not be decided, by the name of the question."""

    @property
    def outcome(self) -> Outcome:
        """The answer about force closure."""
        if self.certificate is None:
            return Outcome.UNDECIDED
        return Outcome.CLOSED if self.certificate.closed else Outcome.OPEN

    @property
    def critical_friction(self) -> float | None:
        """Common coefficient that suffices for closure; infinite if none does."""
        found = self.friction_interval
        return None if found is None else found.critical_friction

    @property
    def separating_wrench(self) -> Array | None:
        """The certificate's wrench with its torque about the grasp's centre, (6,)."""
        wrench = None if self.certificate is None else self.certificate.separating_wrench
        if wrench is None:
            return None
        about = wrench[:3] + np.cross(wrench[3:], self.contacts.center)
        return np.concatenate([about, wrench[3:]])


def check_edges(sets: Iterable[ContactSet], edges: int) -> None:
    """Refuse pyramids with so many edges that their hull would take minutes."""
    for contacts in sets:
        count = len(contacts.positions)
        if count * edges > MOST_EDGES:
            raise InputError(
                f"grasp {contacts.id}: {count} contacts with {edges} edges each exceed "
                f"{MOST_EDGES} edges; use --edges {MOST_EDGES // count} or less"
            )


def analyze(contacts: ContactSet, question: Question) -> Analysis:
    """Answer every question about one grasp that can be decided."""
    given = contacts.positions, contacts.normals, contacts.friction
    edges, center, scale = question.edges, contacts.center, contacts.torque_scale
    ask = _Asking()
    linf = ask("ferrari_canny_linf", lambda: _bounds(contacts, "linf"))
    return Analysis(
        contacts=contacts,
        certificate=ask("closure", lambda: _checked(force_closure(*given))),
        friction_interval=ask(
            "critical_friction", lambda: _checked(critical_friction_interval(*given[:2]))
        ),
        l1=ask("ferrari_canny_l1", lambda: _bounds(contacts, "l1")),
        linf=linf,
        min_weight=ask("min_weight", lambda: min_weight(*given, edges=edges)),
        hull_volume=ask(
            "hull_volume",
            lambda: hull_volume(*given, edges=edges, center=center, torque_scale=scale),
        ),
        smallest_singular_value=smallest_singular_value(
            contacts.positions, center=center, torque_scale=scale
        ),
        weakest_axis=ask("weakest_axis_wrench", lambda: _weakest_axis(contacts, question)),
        everywhere=None if linf is None else max(linf.lower, 0.0) * question.max_normal_force,
        wrenches=tuple(
            ask(f"wrenches[{i}]", lambda load=load: _resisted(contacts, load, question))
            for i, load in enumerate(question.wrenches)
        ),
        undecided=ask.reasons,
    )


@dataclass(slots=True)
class _Asking:
    """Answers questions about one grasp, and keeps the reasons why some have no answer."""

    reasons: dict[str, str] = field(default_factory=dict[str, str])

    def __call__(self, name: str, question: Callable[[], Answer]) -> Answer | None:
        try:
            return question()
        except (UndecidedError, SolverError) as error:
            self.reasons[name] = str(error)
            return None


def _checked(certificate: Checked) -> Checked:
    if not certificate.verify():
        raise UndecidedError(
            "the answer's own certificate failed its check, so the answer cannot be trusted"
        )
    return certificate


def _bounds(contacts: ContactSet, norm: Norm) -> Bounds:
    found = ferrari_canny(
        contacts.positions, contacts.normals, contacts.friction,
        center=contacts.center, torque_scale=contacts.torque_scale, norm=norm,
    )  # fmt: skip
    return Bounds(found.lower, found.upper, found.verify())


def _weakest_axis(contacts: ContactSet, question: Question) -> WrenchLimit:
    limits = wrench_limits(
        contacts.positions, contacts.normals, contacts.friction,
        axis_wrenches(contacts.torque_scale),
        max_normal_force=question.max_normal_force, center=contacts.center,
    )  # fmt: skip
    return limits[first_best([-found.limit for found in limits])]


def _resisted(contacts: ContactSet, wrench: Wrench, question: Question) -> Resisted:
    given = contacts.positions, contacts.normals, contacts.friction
    limit = wrench_limits(
        *given, [wrench], max_normal_force=question.max_normal_force, center=contacts.center
    )[0]
    if limit.upper < 1.0:
        return Resisted(limit, None)
    try:
        limits = 0.0, question.max_normal_force
        forces = contact_forces(*given, wrench, normal_force=limits, center=contacts.center)
    except NoForcesError:
        forces = None
    return Resisted(limit, forces)
