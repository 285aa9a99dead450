"""Simulates one trial of a recorded verdict again.

Trials of a scene do not influence each other, so one by itself moves as it did among the others.
It is simulated twice: until its answer is known, for the verdict as it was recorded, and to the
protocol's full length, to be looked at.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, TypeAlias

from pydantic import Field, computed_field

from grasp_core.allowed_values import FLAT, OrInfinity
from grasp_core.arrays import Wrench
from grasp_core.closure.contacts import contacts_sha256, stacked
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError
from grasp_core.files.file_kinds import GRASPS, VERDICTS
from grasp_core.files.records import UNRECORDED
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.grasps_json import load_grasps
from grasp_core.planning.result import Plan
from grasp_core.values import Contact, Grasp
from scenes.mujoco.closure_scene import Scene
from scenes.mujoco.fingertip_room import clashes
from sim_validate.closure.controls import Control, ControlLoad, ControlTrial, control_case
from sim_validate.closure.validate import OPENED_BY_NOISE, for_repeats, noisy_case, off_faces
from sim_validate.closure.verdict import Verdict, WrenchVerdict, load_verdicts
from sim_validate.engine.held_or_let_go import HoldVerdict, Outcome, judge
from sim_validate.engine.misplacement import disturbed
from sim_validate.engine.planned_loads import LoadPlanner, PlannedLoad
from sim_validate.engine.rig import Rig, Watched, closed_on
from sim_validate.engine.schedules import TrialLoad
from sim_validate.engine.setup import WEAKEST, Agenda, Setup
from sim_validate.planning.asked_objects import grasp_with_id, some


@dataclass(frozen=True, slots=True)
class WantedTrial:
    """Which contact set of a file is to be simulated again."""

    grasp: str | None = None
    control: str | None = None
    """Name of a negative control (contacts that must fail) made from the grasp."""
    trial: int | None = None  # number of a repeat with noise; None for the trials without noise
    grasps: Path | None = None
    """The `grasps.json` that verdicts are about, if it is not beside them."""


@dataclass(frozen=True, slots=True, eq=False)
class Recorded:
    """A contact set of a file, and how its trials ended: a grasp, negative control, or repeat."""

    name: str
    body: Polyhedron
    contacts: tuple[Contact, ...]
    friction: float
    setup: Setup
    agenda: Agenda
    control: str | None = None
    grasp: Grasp | None = None  # the planned grasp that has these contacts; None if it is not known
    trial: int | None = None
    outcomes: Mapping[str, str] = field(default_factory=dict[str, str])
    others: str | None = None
    """How all trials that `outcomes` does not name ended; None if the file does not say."""
    mujoco: str | None = None
    """Version of MuJoCo in which they ended so; None if it is not known."""


@declared
class Replayed(Declared):
    """The motion and outcome of one trial that was simulated again."""

    name: Annotated[str, Field(alias="wrench")]
    load: Annotated[TrialLoad, UNRECORDED]
    predicted_limit: OrInfinity | None
    """Largest multiple of the wrench that is resisted by analysis; None for contacts without force
    closure."""
    required_friction: OrInfinity | None
    """Friction that the planned forces need; None if no forces balance the wrench."""
    friction: float
    hold: Annotated[HoldVerdict, FLAT]
    watched: Annotated[Watched, UNRECORDED]
    scene: Annotated[Scene, UNRECORDED]

    @computed_field
    @property
    def wrench_n_nm(self) -> Wrench:
        """Force, then torque about the centre of mass [N, N m]."""
        return self.load.wrench


def recorded_in(source: Path, wanted: WantedTrial) -> Recorded:
    """Read a contact set from a `verdicts.json`, or from the folder of a run."""
    path = source / VERDICTS if source.is_dir() else source
    found = load_verdicts(path)
    source = wanted.grasps or path.parent / GRASPS
    if not source.is_file():
        raise InputError(
            f"{source}: this file of grasps is missing; say with --grasps where the file is"
        )
    saved = load_grasps(source)
    if saved.body.content_sha256 != found.object_sha256:
        raise InputError(
            f"{source}: these grasps are on another object than the results to replay; give the "
            "right --grasps"
        )
    saved = replace(saved, friction=found.friction)
    verdicts = {each.id: each for each in found}
    grasp = grasp_with_id(path, saved, wanted.grasp)
    if grasp.id not in verdicts:
        raise InputError(
            f"{path}: no verdict on the grasp {grasp.id}; the file has verdicts on {some(verdicts)}"
        )
    recorded = of_verdict(path, saved, verdicts[grasp.id], replace(wanted, grasp=grasp.id))
    return replace(recorded, mujoco=found.gate.mujoco)


def of_verdict(path: Path, saved: Plan, verdict: Verdict, wanted: WantedTrial) -> Recorded:
    """Read a contact set, and how its trials ended, from the verdict on one grasp."""
    grasp = grasp_with_id(path, saved, wanted.grasp)
    if contacts_sha256(grasp.contacts) != verdict.contacts_sha256:
        raise InputError(
            f"{path}: the contacts of {grasp.id} have changed since these results were recorded; "
            "record them again"
        )
    if verdict.not_simulated:
        raise InputError(f"{path}: nothing was simulated of {grasp.id}: {verdict.not_simulated}")
    found = Recorded(
        grasp.id, saved.body, grasp.contacts, saved.friction, verdict.setup, verdict.agenda,
        grasp=grasp, trial=wanted.trial,
    )  # fmt: skip
    if wanted.trial is not None:
        return _in_trial(path, found, verdict, wanted.trial)
    trials: Sequence[WrenchVerdict | ControlTrial] = verdict.wrenches
    if wanted.control is not None:
        control = next((c for c in verdict.controls if c.control.name == wanted.control), None)
        if control is None:
            raise InputError(
                f"{path}: grasp {verdict.id} has no negative control {wanted.control!r}; choose "
                f"from {some(each.control.name for each in verdict.controls)}"
            )
        trials = control.tried
        found = replace(
            found, name=f"{grasp.id}:{wanted.control}", contacts=control.control.contacts,
            friction=control.control.friction, control=wanted.control, grasp=None,
        )  # fmt: skip
    return replace(found, outcomes={each.name: each.hold.outcome.value for each in trials})


def _in_trial(path: Path, found: Recorded, verdict: Verdict, trial: int) -> Recorded:
    found = replace(found, name=f"{found.name} in trial {trial}")
    repeats = () if verdict.robustness is None else verdict.robustness.trials
    if trial >= len(repeats):
        said = f"choose from 0 to {len(repeats) - 1}"
        said = said if repeats else "it was recorded without --repeats"
        raise InputError(f"{path}: the file has no repeat with noise numbered {trial}; {said}")
    ended = repeats[trial]
    if ended.outcome is Outcome.HELD:
        return replace(found, others=Outcome.HELD.value)
    return replace(found, outcomes={ended.wrench: ended.outcome.value})


Loads: TypeAlias = Sequence[PlannedLoad | ControlLoad]


def replayed(
    recorded: Recorded, wrench: str | None = None, *, as_recorded: bool = True
) -> Replayed:
    """Simulate one trial of a recorded contact set again.

    Unless its figures are to be those that were recorded, a trial that holds to its full length is
    simulated only once: no sample of it was lost, so that the recorded one held, too.
    """
    name = wrench or next((each for each, end in recorded.outcomes.items() if end != "held"), None)
    if name is None and recorded.trial is None and recorded.control is None:
        name = WEAKEST
    rig, loads, landed = _case(recorded, name)
    limits = {
        each.name: each.predicted_limit if isinstance(each, PlannedLoad) else None for each in loads
    }
    # the wrench that is hardest to hold
    name = name or min(limits, key=lambda each: limits[each] or 0.0)
    held = next((each for each in loads if each.name == name), None)
    if held is None:
        known = ", ".join(limits)
        raise InputError(f"{recorded.name}: no wrench is named {name!r}; choose from {known}")
    settling = [held.settling] if isinstance(held, ControlLoad) else None
    trials = rig.holds([held.load], settling)
    watched = rig.watch(trials[0])
    layout = rig.bench.scene.layout
    amiss = clashes(recorded.body, *stacked(landed), layout.drive.radius_m) if landed else ()
    if recorded.grasp is not None and recorded.trial is None:
        amiss = amiss or off_faces(rig.bench, recorded.body, recorded.grasp)
    hold = judge(watched.trace, layout, recorded.setup.hold, amiss)
    if as_recorded or hold.outcome is not Outcome.HELD:
        (ended,) = rig.traced(trials)
        hold = judge(ended, layout, recorded.setup.hold, amiss)
    return Replayed(
        name=name,
        load=held.load,
        predicted_limit=limits[name],
        required_friction=held.required_friction,
        friction=rig.friction,
        hold=hold,
        watched=watched,
        scene=rig.bench.scene,
    )


def _case(recorded: Recorded, wanted: str | None) -> tuple[Rig, Loads, tuple[Contact, ...]]:
    """Close fingers on contacts and plan the wanted load, or all; also give contacts with room."""
    body, contacts, friction = recorded.body, recorded.contacts, recorded.friction
    setup = recorded.setup
    if recorded.control is not None:
        return _opened(body, recorded.control, contacts, friction, setup)
    scene = setup.scene(body, recorded.grasp or contacts, friction)
    rig = closed_on(scene, setup, friction)
    planner = LoadPlanner(body, contacts, friction, setup, None)
    only = wanted if recorded.trial is None else None
    planned = planner.planned(rig.idle, recorded.agenda, only)
    if recorded.trial is None or recorded.grasp is None:
        return rig, planned, contacts
    setup, agenda = for_repeats(setup, scene), recorded.agenda
    case = disturbed(body, recorded.grasp, friction, agenda.noise, agenda.seed, recorded.trial)
    if case.missed:
        raise InputError(
            f"{recorded.name}: this repeat has no trial to simulate, because noise made finger "
            f"{case.missed[0]} miss its face"
        )
    if not setup.closure(case.contacts, case.friction).closed:
        return _opened(body, OPENED_BY_NOISE, case.contacts, case.friction, setup)
    rig, heavy = noisy_case(body, case, [(each.name, each.load.wrench) for each in planned], setup)
    return rig, heavy, case.landed


def _opened(
    body: Polyhedron, name: str, contacts: tuple[Contact, ...], friction: float, setup: Setup
) -> tuple[Rig, Loads, tuple[Contact, ...]]:
    """Prepare contacts without force closure as a negative control."""
    certificate = setup.closure(contacts, friction)
    if certificate.closed:
        raise InputError(
            f"{name}: expected contacts without force closure, but these are force-closed at "
            f"friction {friction}"
        )
    return *control_case(body, Control(name, friction, certificate), setup), ()
