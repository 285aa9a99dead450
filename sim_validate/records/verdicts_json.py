"""Writes verdicts as `verdicts.json`, with units in the keys and all settings that were used."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from typing import Any, cast

from grasp_core.arrays import Array
from grasp_core.closure.contacts import contacts_sha256
from grasp_core.files.json_text import text_of
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.provenance import versions
from sim_validate.records.setup_toml import OF_USERS
from sim_validate.records.verdicts_schema import (
    SCHEMA,
    ControlRecord,
    FingersRecord,
    GateRecord,
    HoldRecord,
    ObjectRecord,
    RobustnessRecord,
    SettingsRecord,
    Summary,
    TrialRecord,
    VerdictRecord,
    VerdictsFile,
)
from sim_validate.simulation.gate.gate import Gate
from sim_validate.simulation.hold_verdict import HoldVerdict, Outcome
from sim_validate.validation.control_trials import ControlVerdict
from sim_validate.validation.grasp_verdict import Verdict
from sim_validate.validation.repeats import Robustness
from sim_validate.validation.wrench_verdict import WrenchVerdict


def verdicts_to_json(
    body: Polyhedron, friction: float, verdicts: Iterable[Verdict], gate: Gate, *, complete: bool
) -> str:
    """Write the text of `verdicts.json`; equal verdicts give equal texts."""
    listed = list(verdicts)
    document: VerdictsFile = {
        "schema": SCHEMA,
        "object": object_record(body),
        "friction": friction,
        "complete": complete,
        "gate": gate_record(gate),
        "summary": summary(listed),
        "verdicts": [_verdict_record(body, verdict) for verdict in listed],
    }
    return text_of(finite(document))


def object_record(body: Polyhedron) -> ObjectRecord:
    """Record which object a file is about: its name, and hashes of its file and of its mesh."""
    return {
        "name": body.name,
        "source_sha256": body.source_sha256,
        "content_sha256": body.content_sha256,
    }


def gate_record(gate: Gate) -> GateRecord:
    """Record the gate's results: checks of the simulator on cases with known answers."""
    return {
        "passed": gate.passed,
        "mujoco": gate.mujoco,
        "checks": [
            {"name": each.name, "value": each.value, "least": each.least, "largest": each.largest}
            for each in gate.checks
        ],
    }


def finite(value: Any) -> Any:
    """Replace numbers that JSON lacks (NaN, infinity) by null throughout a tree."""
    if isinstance(value, dict):
        return {name: finite(part) for name, part in cast("dict[str, Any]", value).items()}
    if isinstance(value, list | tuple):
        return [finite(part) for part in cast("list[Any]", value)]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def summary(verdicts: Iterable[Verdict]) -> Summary:
    """Count grasps that held, negative controls that let go, and contradictions."""
    listed = list(verdicts)
    controls = [control for verdict in listed for control in verdict.controls]
    return {
        "grasps": len(listed),
        "grasps_held": sum(verdict.held for verdict in listed),
        "controls": len(controls),
        "controls_held": sum(control.held for control in controls),
        "controls_let_go": sum(control.let_go for control in controls),
        "mismatches": sum(len(verdict.mismatches) for verdict in listed),
    }


def _verdict_record(body: Polyhedron, verdict: Verdict) -> VerdictRecord:
    bounds, friction = verdict.bounds, verdict.critical_friction
    return {
        "id": verdict.id,
        "contacts_sha256": contacts_sha256(verdict.contacts),
        "outcome": verdict.outcome,
        "held": verdict.held,
        "mismatches": list(verdict.mismatches),
        "critical_friction": {
            "predicted": friction.predicted,
            "simulated": friction.simulated,
            "bracket": friction.bracket,
        },
        "wrenches": [_wrench_record(trial) for trial in verdict.wrenches],
        "controls": {
            control.control.name: _control_record(body, control) for control in verdict.controls
        },
        "bounds": None if bounds is None else asdict(bounds),
        "robustness": _robustness_record(verdict.robustness),
        "accepted_by": verdict.accepted_by,
        "settings": _settings(verdict),
        "versions": {**versions()},
    }


def _wrench_record(trial: WrenchVerdict) -> TrialRecord:
    found, predicted = trial.simulated_limit, trial.predicted_limit
    return {
        "name": trial.name,
        "wrench": trial.wrench.tolist(),
        "predicted_limit": predicted,
        "simulated_limit": None if found is None else found.share * predicted,
        "simulated_limit_bracket": (
            None if found is None else (found.lower * predicted, found.upper * predicted)
        ),
        "required_friction": trial.required_friction,
        **_hold_record(trial.hold),
    }


def _hold_record(hold: HoldVerdict) -> HoldRecord:
    return {
        "outcome": hold.outcome,
        "reason": hold.reason,
        "displacement_m": hold.displacement_m,
        "start_displacement_m": hold.start_displacement_m,
        "rotation_rad": hold.rotation_rad,
        "slip_m": hold.slip_m.tolist(),
        "failed_after_s": hold.failed_after_s,
    }


def _control_record(body: Polyhedron, verdict: ControlVerdict) -> ControlRecord:
    control = verdict.control
    return {
        "held": verdict.held,
        "friction": control.friction,
        "contacts": [
            {"position_m": contact.position.tolist(), "normal": contact.normal.tolist()}
            for contact in control.contacts
        ],
        "closure_margin": control.certificate.margin,
        "separating_wrench": control.separating_wrench(body.center_of_mass).tolist(),
        "wrenches": [
            {
                "name": trial.name,
                "wrench": trial.wrench.tolist(),
                "required_friction": trial.required_friction,
                **_hold_record(trial.hold),
            }
            for trial in verdict.tried
        ],
        "accepted_by": verdict.accepted_by,
    }


def _robustness_record(found: Robustness | None) -> RobustnessRecord | None:
    if found is None:
        return None
    return {
        "trials": len(found.trials),
        "held": found.held,
        "predicted": found.predicted,
        "pass_rate": found.held / len(found.trials),
        "pass_rate_interval": found.interval,
        "noise": asdict(found.noise),
        "not_held": [
            {"trial": each.number, "predicted": each.predicted, "outcome": each.outcome,
             "wrench": each.wrench, "reason": each.reason}
            for each in found.trials if each.outcome is not Outcome.HELD
        ],
    }  # fmt: skip


def _settings(verdict: Verdict) -> SettingsRecord:
    layout, setup = verdict.scene.layout, verdict.setup
    fingers = {name: getattr(setup.fingers, name) for name in OF_USERS["fingers"]}
    return {
        "physics": setup.physics.record(),
        "fingers": cast("FingersRecord", fingers),
        "hold": asdict(setup.hold),
        "limit": asdict(setup.limit),
        "friction": asdict(setup.friction),
        "flags": setup.physics.flags(),
        "drive": asdict(layout.drive),
        "surface": setup.surface,
        "grasp_size_m": layout.grasp_size_m,
        "object_mass_kg": layout.mass_kg,
        "object_inertia_kg_m2": layout.inertia_kg_m2.tolist(),
        "random_wrenches": verdict.agenda.random_wrenches,
        "limits": verdict.agenda.limits,
        "seed": verdict.agenda.seed,
    }


def trace_arrays(verdict: Verdict) -> dict[str, Array]:
    """Collect the recorded motion of every contact as arrays, named by trial and quantity."""
    fields = ("times_s", "displacements_m", "shifts_m", "rotations_rad", "slips_m", "gaps_m")
    kept: Sequence[tuple[str, Any]] = [
        *((trial.name, trial.trace) for trial in verdict.wrenches if trial.trace is not None),
        *((f"{control.control.name}.{trial.name}", trial.trace)
          for control in verdict.controls for trial in control.tried if trial.trace is not None),
    ]  # fmt: skip
    return {f"{name}.{field}": getattr(trace, field) for name, trace in kept for field in fields}
