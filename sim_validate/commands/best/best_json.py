"""Writes the best grasp of an object, and the bound on all others, as a JSON document."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.optimizing.best.result import BestGrasp
from grasp_core.provenance import versions
from grasp_core.values import Grasp
from sim_validate.records.best.best_schema import OTHER, USUAL


@dataclass(frozen=True, slots=True)
class Rated:
    """A planned grasp beside the best one."""

    grasp: Grasp
    quality: tuple[float, float]
    """Bounds of its measure."""


def best_to_document(
    body: Polyhedron, best: BestGrasp, planned: Sequence[Rated], proof: str | None
) -> dict[str, object]:
    """Build the JSON document of a search for the best grasp, with units in the keys.

    Measures other than the Ferrari-Canny quality are newtons of weight, or multiples of wrenches,
    so that their keys have no unit.
    """
    grasp, quality, usual = best.grasp, best.quality, best.proof.measure.is_usual
    unit = "_n" if usual else ""
    return {
        "schema": USUAL if usual else OTHER,
        **_loads(body, best),
        "object": {"name": body.name, "content_sha256": body.content_sha256},
        "friction": best.proof.friction,
        "clearance_m": best.clearance,
        "grasp": {
            "id": grasp.id,
            "faces": list(grasp.faces),
            "positions_m": grasp.positions.tolist(),
            "normals": grasp.normals.tolist(),
        },
        f"quality{unit}": [quality.lower, quality.upper],
        f"bound{unit}": best.bound,
        "gap": best.gap,
        "ended": best.ended,
        "proof": proof,
        "proof_nodes": len(best.proof.deeds),
        "history": [
            {
                "seconds": now.seconds, f"quality{unit}": now.quality,
                f"bound{unit}": now.bound, "nodes": now.nodes,
            }
            for now in best.history
        ],
        "planned": [
            {"id": each.grasp.id, f"quality{unit}": list(each.quality),
             "share_of_bound": each.quality[0] / best.bound}
            for each in planned
        ],
        "versions": versions(),
    }  # fmt: skip


def _loads(body: Polyhedron, best: BestGrasp) -> dict[str, object]:
    """Return what says which loads count, for measures other than the Ferrari-Canny quality."""
    measure = best.proof.measure
    if measure.is_usual:
        return {}
    loads = measure.loads * np.repeat([1.0, body.radius], 3)
    return {
        "measure": measure.name,
        "wrenches": [
            {"force_n": load[:3].tolist(), "torque_n_m": load[3:].tolist()} for load in loads
        ],
    }
