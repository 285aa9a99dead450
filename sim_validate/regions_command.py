"""The command that certifies independent regions for grasps of a file."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from grasp_core.arrays import Array
from grasp_core.certified_regions import CertifiedRegions, certify_regions
from grasp_core.errors import InputError
from grasp_core.values import ContactRegion, Grasp, Polyhedron
from grasp_core.versions import versions
from sim_validate import cli
from sim_validate.console import TABLE_ROWS, Reporter
from sim_validate.engines import each
from sim_validate.files import write_arrays, write_text
from sim_validate.grasps_file import read_grasps
from sim_validate.plan_command import say_cut

SCHEMA = 1
REGIONS, PROOFS = "regions.json", "proofs"
MILLI = 1e3


@dataclass(frozen=True, slots=True, eq=False)
class _Task:
    """One grasp, as it travels to a worker."""

    body: Polyhedron
    grasp: Grasp
    friction: float
    reserve: float
    cones: int


def certify_file(command: cli.Regions, reporter: Reporter) -> int:
    """Certify regions of a file's grasps, show them, and write them with their proofs."""
    saved = read_grasps(command.grasps)
    chosen = [grasp for grasp in saved.grasps if command.grasp in (None, grasp.id)][: command.limit]
    if not chosen:
        raise InputError(f"{command.grasps}: no grasp {command.grasp or ''}")
    friction = saved.friction if command.friction is None else command.friction
    tasks = [_Task(saved.body, grasp, friction, command.reserve, command.cones) for grasp in chosen]
    found = dict[str, CertifiedRegions | None]()
    with reporter.progress("certifying") as steps:
        answers = each(_certified, tasks, jobs=command.jobs)
        for grasp, proved in zip(chosen, answers, strict=True):
            found[grasp.id] = proved
            if command.out is not None and proved is not None:
                path = command.out / PROOFS / f"{grasp.id}.npz"
                write_arrays(path, proof_arrays(proved))
            steps.update(len(found), len(tasks))
    document = {
        "schema": SCHEMA,
        "object": {"name": saved.body.name, "content_sha256": saved.body.content_sha256},
        "friction": friction,
        "reserve": command.reserve,
        "cones": command.cones,
        "versions": versions(),
        "grasps": [_record(grasp, found[grasp.id]) for grasp in chosen],
    }
    _show(chosen, found, reporter)
    if command.out is not None:
        text = json.dumps(document, allow_nan=False, indent=1) + "\n"
        reporter.say(f"wrote {write_text(command.out / REGIONS, text)}")
    reporter.document(document)
    return cli.Exit.GOOD if all(found.values()) else cli.Exit.NEGATIVE


def _certified(task: _Task) -> CertifiedRegions | None:
    return certify_regions(
        task.body, task.grasp, task.friction, reserve=task.reserve, cones=task.cones
    )


def proof_arrays(proved: CertifiedRegions) -> dict[str, Array]:
    """Everything that `CertifiedRegions.verify` looks at, by name."""
    cover = proved.cover
    regions = {f"region{i}_m": region.polygon for i, region in enumerate(proved.regions)}
    return {
        "axes": cover.axes,
        "codes": cover.codes.astype(np.uint8),
        "contacts": cover.contacts.astype(np.uint8),
        "forces": cover.forces,
        "normals": proved.normals,
        "friction": np.array(proved.friction),
        "center_m": proved.center,
        "scale_m": np.array(proved.scale),
        **regions,
    }  # pyright: ignore[reportReturnType] - whole numbers are kept as such


def _record(grasp: Grasp, proved: CertifiedRegions | None) -> Mapping[str, Any]:
    if proved is None:
        return {"id": grasp.id, "radius_m": None, "cones": None, "regions": None}
    return {
        "id": grasp.id,
        "radius_m": proved.radius,
        "cones": len(proved.cover.contacts),
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
            rows.append((grasp.id, grasp.family, planned, "none proved", "", ""))
            continue
        smallest = min(region.inscribed_radius for region in proved.regions)
        area = sum(map(area_of, proved.regions))
        rows.append(
            (grasp.id, grasp.family, planned, f"{MILLI * smallest:.2f}",
             f"{MILLI**2 * area:.4g}", str(len(proved.cover.contacts)))
        )  # fmt: skip
    columns = ("grasp", "family", "planned mm", "certified mm", "area mm2", "cones of twists")
    reporter.table("independent regions: smallest inscribed disc", columns, rows)
    say_cut(len(grasps), reporter)
