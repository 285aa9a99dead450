"""Writes the best grasp of an object, and the bound on all others, as a JSON document."""

from collections.abc import Sequence

from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.optimizing.best.best_grasp import BestGrasp
from grasp_core.provenance import versions
from grasp_core.values import Grasp

SCHEMA = 1


def best_to_document(
    body: Polyhedron, best: BestGrasp, planned: Sequence[Grasp], proof: str | None
) -> dict[str, object]:
    """Build the JSON document of a search for the best grasp, with units in the keys.

    Args:
        body: The object.
        best: What the search found.
        planned: Grasps that were planned, to be compared with it.
        proof: Name of the file that holds the proof, or None.
    """
    grasp, quality = best.grasp, best.quality
    return {
        "schema": SCHEMA,
        "object": {"name": body.name, "content_sha256": body.content_sha256},
        "friction": best.proof.friction,
        "clearance_m": best.clearance,
        "grasp": {
            "id": grasp.id,
            "faces": list(grasp.faces),
            "positions_m": grasp.positions.tolist(),
            "normals": grasp.normals.tolist(),
        },
        "quality_n": [quality.lower, quality.upper],
        "bound_n": best.bound,
        "gap": best.gap,
        "ended": best.ended,
        "proof": proof,
        "proof_nodes": len(best.proof.deeds),
        "history": [
            {
                "seconds": now.seconds, "quality_n": now.quality, "bound_n": now.bound,
                "nodes": now.nodes,
            }
            for now in best.history
        ],
        "planned": [
            {"id": each.id, "quality_n": list(each.ferrari_canny),
             "share_of_bound": each.ferrari_canny[0] / best.bound}
            for each in planned
        ],
        "versions": versions(),
    }  # fmt: skip
