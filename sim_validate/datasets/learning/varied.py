"""Tries the varied grasps of a unit of work, and the synthetic negative controls that it keeps."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from grasp_core.closure.contacts import contacts_sha256
from grasp_core.errors import InputError, NoForcesError, UnfaithfulError
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Grasp
from sim_validate.datasets.execution_rows import Executed, executed_by
from sim_validate.datasets.learning.settings import CONTROLS, Learning
from sim_validate.datasets.learning.variants import Variant, draws, unmoved, variants, with_mass
from sim_validate.execution.execute import execute
from sim_validate.execution.settings import AskedExecution, ExecutionSettings
from sim_validate.execution.verdict import ExecutedGrasp
from sim_validate.simulation.gate import Gate
from sim_validate.simulation.setup import Agenda, Setup
from sim_validate.validation.controls import Control, ControlVerdict, negative_controls, try_control
from sim_validate.validation.validation import tested, validate
from sim_validate.validation.verdict import Verdict

VARIED = "varied"
"""Label of rows that are made from a grasp and may hold or not."""


@dataclass(frozen=True, slots=True, eq=False)
class Tried:
    """A varied grasp with its trials and its execution."""

    variant: Variant
    verdict: Verdict | ControlVerdict
    executed: Executed


def validated_with(
    body: Polyhedron, grasp: Grasp, friction: float, agenda: Agenda, asked: Learning | None
) -> Verdict:
    """Test a grasp in simulation, with as many synthetic negative controls as are asked for."""
    most = CONTROLS if asked is None else asked.synthetic
    if most == CONTROLS:
        return validate(body, grasp, friction, agenda=agenda)
    verdict = validate(body, grasp, friction, agenda=replace(agenda, controls=False))
    found = list[Control]()
    if most:
        found += negative_controls(body, grasp, friction, agenda.seed)
    order = draws(agenda.seed, grasp.id, "synthetic", 0).permutation(len(found))
    kept = [found[int(place)] for place in np.sort(order[:most])]
    controls = tuple(try_control(body, each, agenda, Setup()) for each in kept)
    return replace(verdict, controls=controls, agenda=agenda)


@dataclass(frozen=True, slots=True, eq=False)
class Varying:
    """How the grasps of one unit of work are varied and tried."""

    asked: Learning
    friction: float
    agenda: Agenda
    execution: AskedExecution | None

    def of(
        self, body: Polyhedron, grasp: Grasp, verdict: Verdict, executed: Executed
    ) -> Iterator[Tried]:
        """Yield the varied grasps made from a grasp, with their trials."""
        for each in variants(body, grasp, self.friction, self.asked, self.agenda.seed):
            try:
                yield Tried(each, self._verdict(each, verdict.gate), self._executed(each))
            except InputError:  # fingertips find no room
                continue
        yield from self._heavier(body, grasp, verdict, executed)

    def _heavier(
        self, body: Polyhedron, grasp: Grasp, verdict: Verdict, executed: Executed
    ) -> Iterator[Tried]:
        """Yield the grasp with other masses; its other trials are the same."""
        if not isinstance(executed, ExecutedGrasp) or executed.execution is None:
            return
        lost_kg = executed.least_predicted_loss * executed.execution.mass_kg
        alone = replace(verdict, controls=())
        for number in range(self.asked.mass_near):
            rng = draws(self.agenda.seed, grasp.id, "mass_near", number)
            each = with_mass(unmoved(body, grasp, self.friction, number), lost_kg, rng)
            if each is not None:
                yield Tried(each, alone, self._executed(each))

    def _verdict(self, variant: Variant, gate: Gate) -> Verdict | ControlVerdict:
        seated, friction = variant.seated, variant.friction
        if isinstance(variant.proved, Grasp):
            agenda = replace(self.agenda, controls=False, critical_friction=False)
            return tested(seated.body, variant.proved, friction, gate, agenda, Setup())
        control = Control(VARIED, seated.contacts, friction, variant.proved)
        return try_control(seated.body, control, self.agenda, Setup())

    def _executed(self, variant: Variant) -> Executed:
        """Execute the contacts if that is asked for, in force closure or not."""
        if self.execution is None:
            return None
        try:
            settings = self.execution.settings_for(variant.seated.body)
            if variant.mass_kg is not None:
                settings = replace(settings, mass_kg=variant.mass_kg)
            return executed_by(partial(_executed_with, variant), settings, self.asked.seeds)
        except (InputError, UnfaithfulError) as error:
            # a varied mass or friction may be beyond what the simulator is faithful for
            return str(error)


def _executed_with(variant: Variant, settings: ExecutionSettings) -> ExecutedGrasp:
    """Execute the contacts of a variant; contacts without a squeeze are a result with a reason."""
    contacts = variant.seated.contacts
    found, reason = None, None
    try:
        found = execute(variant.seated.body, contacts, variant.friction, settings, enough=False)
    except NoForcesError as error:
        reason = str(error)
    family = variant.proved.family if isinstance(variant.proved, Grasp) else ""
    return ExecutedGrasp(variant.name, family, contacts_sha256(contacts), found, reason)
