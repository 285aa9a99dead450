"""Writes analyses of contact sets as one JSON document, with units in the keys."""

import math
from collections import Counter
from collections.abc import Sequence
from typing import Any

from grasp_core.arrays import Array
from grasp_core.closure.friction_interval import FrictionInterval
from grasp_core.provenance import versions
from grasp_core.quality.wrench_limits import WrenchLimit
from sim_validate.planning.contact_analysis import Analysis, Bounds, Outcome, Question, Resisted


def analyses_to_document(
    source: str, question: Question, analyses: Sequence[Analysis], *, complete: bool
) -> dict[str, object]:
    """Build the JSON document of all analyses of a file; equal analyses give equal documents."""
    return {
        "source": source,
        "max_normal_force_n": question.max_normal_force,
        "edges": question.edges,
        "versions": versions(),
        "complete": complete,
        "summary": summary(analyses),
        "grasps": [_analysis_record(analysis) for analysis in analyses],
    }


def summary(analyses: Sequence[Analysis]) -> dict[str, int]:
    """Count the grasps, and the grasps of each outcome."""
    counts = Counter(analysis.outcome for analysis in analyses)
    return {"grasps": len(analyses)} | {outcome.value: counts[outcome] for outcome in Outcome}


def _analysis_record(analysis: Analysis) -> dict[str, object]:
    given, certificate = analysis.contacts, analysis.certificate
    l1, linf = analysis.l1, analysis.linf
    return {
        "id": given.id,
        "outcome": analysis.outcome.value,
        "closed": None if certificate is None else certificate.closed,
        "closure_margin": None if certificate is None else _number(certificate.margin),
        "forces": None if certificate is None else _rows(certificate.forces),
        "separating_wrench": _rows(analysis.separating_wrench),
        "critical_friction": _number(analysis.critical_friction),
        "critical_friction_interval": _pair(analysis.friction_interval),
        "ferrari_canny_l1_n": _pair(l1),
        "ferrari_canny_linf_n": _pair(linf),
        "verified": {
            "closure": certificate is not None,
            "ferrari_canny_l1_n": l1 is not None and l1.verified,
            "ferrari_canny_linf_n": linf is not None and linf.verified,
        },
        "min_weight": _number(analysis.min_weight),
        "hull_volume": _number(analysis.hull_volume),
        "smallest_singular_value": _number(analysis.smallest_singular_value),
        "weakest_axis_wrench": _limit_record(analysis.weakest_axis),
        "resisted_in_every_direction_n": _number(analysis.everywhere),
        "wrenches": [_resisted_record(found) for found in analysis.wrenches],
        "undecided": analysis.undecided,
        "center_m": given.center.tolist(),
        "center_from": given.center_from,
        "torque_scale_m": given.torque_scale,
        "torque_scale_from": given.torque_scale_from,
        "contacts": [
            {"position_m": position.tolist(), "normal": normal.tolist(), "friction": friction}
            for position, normal, friction in zip(
                given.positions, given.normals, given.friction.tolist(), strict=True
            )
        ],
    }


def _limit_record(found: WrenchLimit | None) -> dict[str, object] | None:
    if found is None:
        return None
    return {
        "wrench": found.wrench.tolist(),
        "limit": _number(found.limit),
        "upper": _number(found.upper),
    }


def _resisted_record(found: Resisted | None) -> dict[str, object] | None:
    if found is None:
        return None
    record = _limit_record(found.limit) or {}
    return record | {"least_norm_forces_n": _rows(found.forces)}


def _number(value: float | None) -> float | None:
    """Convert a number for JSON: None if it is unknown or infinite, and 0.0 for minus zero."""
    return None if value is None or not math.isfinite(value) else value + 0.0


def _pair(bounds: Bounds | FrictionInterval | None) -> list[float | None] | None:
    return None if bounds is None else [_number(bounds.lower), _number(bounds.upper)]


def _rows(array: Array | None) -> Any:
    return None if array is None else array.tolist()
