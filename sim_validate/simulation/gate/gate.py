"""Checks the simulator on cases with known answers before any grasp is simulated."""

import math
from dataclasses import dataclass, replace

from grasp_core.errors import UnfaithfulError
from grasp_core.provenance import versions
from sim_validate.simulation.gate.case import Case, Check
from sim_validate.simulation.gate.known_cases import known_answers, mesh_touches
from sim_validate.simulation.setup import Setup

USUAL_FRICTION, USUAL_RADIUS_M = 0.5, 0.07
MOST_KNOWN = 256
"""Number of settings whose results are kept."""


@dataclass(frozen=True, slots=True)
class Gate:
    """The results of checking the simulator on cases with known answers."""

    checks: tuple[Check, ...]
    mujoco: str
    """Version of MuJoCo that was checked."""

    @property
    def passed(self) -> bool:
        """Whether all checks passed."""
        return all(check.passed for check in self.checks)


_KNOWN: dict[Case, Gate] = {}
"""Results of the settings that were measured last."""


def require_faithful(
    setup: Setup, friction: float = USUAL_FRICTION, radius_m: float = USUAL_RADIUS_M
) -> Gate:
    """Check the simulator on known cases, and refuse settings under which a check fails."""
    gate = measured_gate(setup, friction, radius_m)
    if not gate.passed:
        failed = "; ".join(str(check) for check in gate.checks if not check.passed)
        raise UnfaithfulError(
            "the simulator is not faithful with these settings, so no grasp is certified; these "
            f"checks failed: {failed}"
        )
    return gate


def measured_gate(
    setup: Setup, friction: float = USUAL_FRICTION, radius_m: float = USUAL_RADIUS_M
) -> Gate:
    """Check the simulator on known cases, once per process for the same settings.

    Takes `radius_m` [m].
    """
    case = _case(setup, friction, radius_m)
    return _KNOWN.get(case) or _kept(case, _measured(case))


def remember_gate(gate: Gate, setup: Setup, friction: float, radius_m: float) -> None:
    """Take over what `measured_gate` returned in the process that started this one.

    Takes `radius_m` [m].
    """
    _kept(_case(setup, friction, radius_m), gate)


def _case(setup: Setup, friction: float, radius_m: float) -> Case:
    # Two digits of the radius let objects of nearly the same size share one measurement.
    fingers = replace(setup.fingers, radius_m=None, approach=None)
    setup = replace(setup, fingers=fingers, threads=1, timeout_s=math.inf)
    return Case(setup, friction, float(f"{radius_m:.1e}"))


def _kept(case: Case, gate: Gate) -> Gate:
    _KNOWN[case] = gate
    if len(_KNOWN) > MOST_KNOWN:
        del _KNOWN[next(iter(_KNOWN))]
    return gate


def _measured(case: Case) -> Gate:
    pads = replace(case, setup=replace(case.setup, surface="pads"))  # controls are always on pads
    checks = known_answers(pads)
    if case.setup.surface == "mesh":
        meshes = (*mesh_touches(case), *known_answers(case))
        checks += tuple(replace(check, name=f"on a mesh: {check.name}") for check in meshes)
    return Gate(checks, versions()["mujoco"])
