"""The command that certifies independent regions for grasps of a file."""

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grasp_core.certified_regions import CertifiedRegions
from grasp_core.errors import InputError
from grasp_core.values import ContactRegion, Grasp
from grasp_core.versions import versions
from sim_validate import cli
from sim_validate.certifying import Asked, certified
from sim_validate.console import TABLE_ROWS, Reporter
from sim_validate.files import write_arrays, write_text
from sim_validate.grasps_file import read_grasps
from sim_validate.plan_command import say_cut

SCHEMA = 2
REGIONS, PROOFS = "regions.json", "proofs"
MILLI = 1e3


def certify_file(command: cli.Regions, reporter: Reporter) -> int:
    """Certify regions of a file's grasps, show them, and write them with their proofs."""
    saved = read_grasps(command.grasps)
    chosen = [grasp for grasp in saved.grasps if command.grasp in (None, grasp.id)][: command.limit]
    if not chosen:
        raise InputError(f"{command.grasps}: no grasp {command.grasp or ''}")
    asked = Asked(
        saved.friction if command.friction is None else command.friction,
        command.reserve, command.balance, command.recenter, command.edge_clearance_m, command.cones,
    )  # fmt: skip
    found = dict[str, CertifiedRegions | None]()
    for grasp, proved in certified(saved.body, chosen, asked, jobs=command.jobs, reporter=reporter):
        found[grasp.id] = proved
        if command.out is not None and proved is not None:
            write_arrays(command.out / PROOFS / f"{grasp.id}.npz", proof_arrays(proved))
    document = {
        "schema": SCHEMA,
        "object": {"name": saved.body.name, "content_sha256": saved.body.content_sha256},
        "friction": asked.friction,
        "reserve": asked.reserve,
        "balance": asked.balance,
        "recenter": asked.recenter,
        "edge_clearance_m": asked.clearance,
        "cones": asked.cones,
        "versions": versions(),
        "grasps": [_record(grasp, found[grasp.id]) for grasp in chosen],
    }
    _show(chosen, found, reporter)
    if command.out is not None:
        text = json.dumps(document, allow_nan=False, indent=1) + "\n"
        reporter.say(f"wrote {write_text(command.out / REGIONS, text)}")
    reporter.document(document)
    return cli.Exit.GOOD if all(found.values()) else cli.Exit.NEGATIVE


def proof_arrays(proved: CertifiedRegions) -> dict[str, NDArray[Any]]:
    """Everything that `CertifiedRegions.verify` looks at, by name."""
    cover = proved.cover
    regions = {f"region{i}_m": region.polygon for i, region in enumerate(proved.regions)}
    return {
        "axes": cover.axes,
        "codes": cover.codes.astype(np.uint8),
        "forces": cover.forces,
        "normals": proved.normals,
        "friction": proved.friction,
        "origin_m": proved.origin,
        "depths_m": proved.depths,
        "scale_m": np.array(proved.scale),
        **regions,
    }


def _record(grasp: Grasp, proved: CertifiedRegions | None) -> Mapping[str, Any]:
    if proved is None:
        return {"id": grasp.id, "family": grasp.family, "radius_m": None, "regions": None}
    open_choice = proved.open_choice
    return {
        "id": grasp.id,
        "family": grasp.family,
        "radius_m": proved.radius,
        "centers_m": proved.centers.tolist(),
        "friction": proved.friction.tolist(),
        "limit_m": None if open_choice is None else proved.limit,
        "open_choice_m": None if open_choice is None else open_choice.tolist(),
        "cones": len(proved.cover.forces),
        "regions": [
            {
                "kind": region.kind,
                "polygon_m": region.polygon.tolist(),
                "inscribed_radius_m": region.inscribed_radius,
                "area_m2": area_of(region),
            }
            for region in proved.regions
        ],
    }


def area_of(region: ContactRegion) -> float:
    """Area of a convex region [m^2]."""
    sides = region.polygon[1:] - region.polygon[0]
    crossed = np.cross(sides[:-1], sides[1:])
    return 0.5 * float(np.linalg.norm(crossed.sum(axis=0)))


def _show(
    grasps: list[Grasp], found: Mapping[str, CertifiedRegions | None], reporter: Reporter
) -> None:
    rows: list[tuple[str, ...]] = []
    for grasp in grasps[:TABLE_ROWS]:
        proved = found[grasp.id]
        planned = f"{MILLI * grasp.radius:.2f}"
        if proved is None:
            rows.append((grasp.id, grasp.family, planned, "none proved", "", "", ""))
            continue
        smallest = min(region.inscribed_radius for region in proved.regions)
        area = sum(map(area_of, proved.regions))
        rows.append(
            (grasp.id, grasp.family, planned, f"{MILLI * smallest:.2f}",
             "" if proved.open_choice is None else f"{proved.radius / proved.limit:.2f}",
             f"{MILLI**2 * area:.4g}", str(len(proved.cover.forces)))
        )  # fmt: skip
    columns = ("grasp", "family", "planned mm", "certified mm", "of limit", "area mm2", "cones")
    reporter.table("independent regions: their smallest inscribed disc", columns, rows)
    say_cut(len(grasps), reporter)
