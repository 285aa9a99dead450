"""Fingertips as flags and plans ask for them."""

from dataclasses import replace

from grasp_core.planning.reach import Finger
from scenes.fingertips import FingerSettings
from sim_validate.cli import flag_groups


def planned_fingers(given: flag_groups.Fingers, planned: Finger | None) -> flag_groups.Fingers:
    """Fingertips of the radius that was planned for, unless another is asked for."""
    if planned is None or given.fingertip_radius_m is not None:
        return given
    return replace(given, fingertip_radius_m=planned.radius_m)


def finger_settings(given: flag_groups.Fingers) -> FingerSettings:
    """What the flags say about fingertips."""
    return FingerSettings(
        max_normal_force_n=given.max_normal_force,
        radius_m=given.fingertip_radius_m,
        mass_kg=given.fingertip_mass_kg,
        stiffness_n_per_m=given.stiffness_n_per_m,
        approach=given.approach,
    )
