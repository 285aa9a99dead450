"""Makes the row of an object, and chooses its split by the hash of its mesh."""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from grasp_core.objects.polyhedron import Polyhedron
from sim_validate.datasets.units import WorkUnit

SPLITS = (("test", 0.1), ("validation", 0.2), ("train", 1.0))
"""Upper ends of each split's share of hashes: an object is in the first split whose end is above
its hash."""


def split_of(object_id: str, seed: int) -> str:
    """Choose the split of an object by its hash, so that adding objects moves no other object."""
    digest = hashlib.sha256(f"{seed} {object_id}".encode()).digest()
    share = int.from_bytes(digest[:8], "big") / 2.0**64
    return next(name for name, upto in SPLITS if share < upto)


def object_row(body: Polyhedron, unit: WorkUnit) -> Mapping[str, Any]:
    """Make the row of a unit's object."""
    return {
        "object_id": body.content_sha256,
        "source_name": Path(unit.object).name,
        "source_sha256": unit.source_sha256,
        "split": split_of(body.content_sha256, unit.config.seed),
        "vertices": len(body.vertices),
        "triangles": len(body.triangles),
        "faces": len(body.faces),
        "curved": body.patches is not None,
        "volume_m3": body.volume,
        "volume_source": body.surface.volume_source,
        "radius_m": body.radius,
        "center_of_mass_m": body.center_of_mass.tolist(),
    }
