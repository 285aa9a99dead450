"""Checks the simulator on cases with known answers before any grasp is executed."""

from dataclasses import replace
from functools import lru_cache

from grasp_core.errors import UnfaithfulError
from grasp_core.provenance import versions
from scenes.execution.held import HeldLayout, HeldSettings
from scenes.physics import PhysicsSettings
from sim_validate.execution.gate.free_box import free_box
from sim_validate.execution.gate.held_box import held_box
from sim_validate.execution.gate.held_case import WEIGHT, HeldCase
from sim_validate.execution.gate.struck_box import struck_box
from sim_validate.execution.gate.surface import surfaces
from sim_validate.simulation.gate import Gate


def require_faithful_execution(
    layout: HeldLayout, physics: PhysicsSettings, hand: HeldSettings, push_n: float
) -> None:
    """Check the simulator on known cases, and refuse settings under which a check fails.

    Takes `push_n` [N].
    """
    for case in cases_of(layout, physics, hand, push_n):
        failed = [check for check in measured_case(case).checks if not check.passed]
        if failed:
            raise UnfaithfulError(
                "the simulator is not faithful with these settings, so no grasp is executed; these "
                f"checks failed: {'; '.join(str(check) for check in failed)}"
            )


def cases_of(
    layout: HeldLayout, physics: PhysicsSettings, hand: HeldSettings, push_n: float
) -> tuple[HeldCase, ...]:
    """Return the case to check for each friction of a scene, with numbers of two digits.

    Gravity points down the box's free axis, whatever its direction in the scene.
    """
    upright = replace(physics, gravity=tuple(WEIGHT.tolist()))
    return tuple(
        HeldCase(
            mass_kg=_rounded(layout.mass_kg),
            stiffness_n_per_m=_rounded(layout.stiffest),
            push_n=_rounded(push_n),
            friction=friction,
            radius_m=_rounded(layout.radius_m),
            tip_radius_m=_rounded(float(layout.tip_radius_m.max())),
            tip_mass_kg=_rounded(hand.tip_mass_kg),
            damping_ratio=_rounded(hand.damping_ratio),
            physics=upright,
        )
        for friction in sorted({_rounded(each) for each in layout.friction.tolist()})
    )


@lru_cache(maxsize=256)
def measured_case(case: HeldCase) -> Gate:
    """Check the simulator on all known cases, once per process for the same settings."""
    checks = (*held_box(case), *free_box(case), struck_box(case), *surfaces(case))
    return Gate(checks, versions()["mujoco"])


def _rounded(value: float) -> float:
    """Round to two digits, so that objects that are nearly alike share one measurement."""
    return float(f"{value:.1e}")
