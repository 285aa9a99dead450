"""Verdicts -> JSON text, with units in the keys and every setting that was in force."""

import json
from collections.abc import Iterable
from dataclasses import asdict

from grasp_core.values import Polyhedron
from grasp_core.versions import versions
from scenes.physics import flags
from sim_validate.validation import ControlVerdict, Verdict, WrenchVerdict

SCHEMA = 1


def verdicts_to_json(
    body: Polyhedron, friction: float, verdicts: Iterable[Verdict], *, complete: bool
) -> str:
    """The text of `verdicts.json`: the same for the same verdicts.

    Args:
        body: The object.
        friction: Coulomb coefficient tested.
        verdicts: One per grasp.
        complete: Whether every grasp of the plan was tested.
    """
    listed = list(verdicts)
    document = {
        "schema": SCHEMA,
        "object": {
            "name": body.name,
            "source_sha256": body.source_sha256,
            "content_sha256": body.content_sha256,
        },
        "friction": friction,
        "complete": complete,
        "summary": summary(listed),
        "verdicts": [_verdict_record(body, verdict) for verdict in listed],
    }
    return json.dumps(document, allow_nan=False, indent=1) + "\n"


def summary(verdicts: Iterable[Verdict]) -> dict[str, int]:
    """How many grasps and controls there were, and how many of each held."""
    listed = list(verdicts)
    controls = [control for verdict in listed for control in verdict.controls]
    return {
        "grasps": len(listed),
        "grasps_held": sum(verdict.held for verdict in listed),
        "controls": len(controls),
        "controls_held": sum(control.held for control in controls),
    }


def _verdict_record(body: Polyhedron, verdict: Verdict) -> dict[str, object]:
    return {
        "id": verdict.id,
        "outcome": verdict.outcome.value,
        "held": verdict.held,
        "critical_friction": asdict(verdict.critical_friction),
        "wrenches": [_wrench_record(trial) for trial in verdict.wrenches],
        "controls": {
            control.control.name: _control_record(body, control) for control in verdict.controls
        },
        "settings": _settings(verdict),
        "versions": versions(),
    }


def _wrench_record(trial: WrenchVerdict) -> dict[str, object]:
    hold = trial.hold
    return {
        "name": trial.name,
        "wrench": trial.wrench.tolist(),
        "predicted_limit": trial.predicted_limit,
        "simulated_limit": None,
        "required_friction": trial.required_friction,
        "outcome": hold.outcome.value,
        "displacement_m": hold.displacement_m,
        "rotation_rad": hold.rotation_rad,
        "slip_m": hold.slip_m.tolist(),
        "failed_after_s": hold.failed_after_s,
    }


def _control_record(body: Polyhedron, verdict: ControlVerdict) -> dict[str, object]:
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
        "wrenches": [_wrench_record(trial) for trial in verdict.tried],
    }


def _settings(verdict: Verdict) -> dict[str, object]:
    layout = verdict.scene.layout
    physics = verdict.scene.physics
    return {
        "protocol": asdict(verdict.protocol),
        "physics": physics.options() | physics.contact() | {"flags": flags()},
        "fingers": asdict(layout.drive),
        "grasp_size_m": layout.grasp_size_m,
        "object_mass_kg": layout.mass_kg,
        "object_inertia_kg_m2": layout.inertia_kg_m2.tolist(),
    }
