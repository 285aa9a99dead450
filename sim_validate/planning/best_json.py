"""Writes and reads `best.json`: the best grasp of an object, and the bound on all others."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import Field
from typing_extensions import TypedDict

from grasp_core.errors import InputError
from grasp_core.files.json_text import record_of
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.provenance import versions
from grasp_core.quality.measures import MeasureName
from grasp_core.values import FINGERS, Grasp
from sim_validate.kit.fields import Count, Finite, ObjectRecord, Positive, Triple

if TYPE_CHECKING:  # reports need no search
    from grasp_core.optimizing.best.result import BestGrasp

SCHEMA = 1
Bounds = tuple[Finite, Finite]
FourTriples = tuple[Triple, Triple, Triple, Triple]


class BestGraspRecord(TypedDict):
    """Fields about the best grasp that was found."""

    id: str
    faces: Annotated[list[int], Field(min_length=FINGERS, max_length=FINGERS)]
    positions_m: FourTriples
    normals: FourTriples


class LoadRecord(TypedDict):
    """Fields about a wrench of a task."""

    force_n: Triple
    torque_n_m: Triple


class StepRecord(TypedDict):
    """Fields about one step by which the gap closed."""

    seconds: Finite
    quality: Finite
    bound: Finite
    nodes: Count


class PlannedRecord(TypedDict):
    """Fields about a planned grasp beside the best one."""

    id: str
    quality: Bounds
    share_of_bound: Finite


class BestFile(TypedDict):
    """The content of `best.json`; what the measure says and its unit are in docs/best-grasp.md."""

    schema: Literal[1]
    measure: MeasureName
    wrenches: list[LoadRecord]
    """The wrenches of a task; none for another measure."""
    object: ObjectRecord
    friction: Positive
    clearance_m: Positive
    grasp: BestGraspRecord
    quality: Bounds
    bound: Positive
    gap: Annotated[float, Field(ge=0.0, le=1.0)]
    ended: Literal["gap", "time", "interrupt", "undivided"]
    proof: str | None
    proof_nodes: Count
    history: list[StepRecord]
    planned: list[PlannedRecord]
    versions: dict[str, str]


@dataclass(frozen=True, slots=True)
class Rated:
    """A planned grasp beside the best one."""

    grasp: Grasp
    quality: tuple[float, float]
    """Bounds of its measure."""


def best_to_document(
    body: Polyhedron, best: "BestGrasp", planned: Sequence[Rated], proof: str | None
) -> dict[str, object]:
    """Build the JSON document of a search for the best grasp."""
    grasp, quality, measure = best.grasp, best.quality, best.proof.measure
    loads = () if measure.is_usual else measure.loads * np.repeat([1.0, body.radius], 3)
    return {
        "schema": SCHEMA,
        "measure": measure.name,
        "wrenches": [
            {"force_n": load[:3].tolist(), "torque_n_m": load[3:].tolist()} for load in loads
        ],
        "object": {"name": body.name, "content_sha256": body.content_sha256},
        "friction": best.proof.friction,
        "clearance_m": best.clearance,
        "grasp": {
            "id": grasp.id,
            "faces": list(grasp.faces),
            "positions_m": grasp.positions.tolist(),
            "normals": grasp.normals.tolist(),
        },
        "quality": [quality.lower, quality.upper],
        "bound": best.bound,
        "gap": best.gap,
        "ended": best.ended,
        "proof": proof,
        "proof_nodes": len(best.proof.deeds),
        "history": [
            {"seconds": now.seconds, "quality": now.quality, "bound": now.bound, "nodes": now.nodes}
            for now in best.history
        ],
        "planned": [
            {
                "id": each.grasp.id,
                "quality": list(each.quality),
                "share_of_bound": each.quality[0] / best.bound,
            }
            for each in planned
        ],
        "versions": versions(),
    }


def best_of(text: str) -> BestFile:
    """Read the text of a `best.json`."""
    found = record_of(BestFile, text, "best.json", schema=SCHEMA)
    name, quality, bound = found["grasp"]["id"], found["quality"][0], found["bound"]
    if quality > bound:
        raise InputError(
            f"bound: expected at least the quality {quality:g} of {name}, got {bound:g}"
        )
    return found


def shares_of_bound(best: BestFile) -> dict[str, float]:
    """Return how much of the bound each compared grasp reaches, by id."""
    shares = {each["id"]: each["quality"][0] / best["bound"] for each in best["planned"]}
    return {**shares, best["grasp"]["id"]: best["quality"][0] / best["bound"]}
