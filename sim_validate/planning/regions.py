"""Runs the command `regions`, which proves where each finger of a grasp may stand."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.force_closure import force_closure
from grasp_core.errors import InputError, SolverError, UndecidedError
from grasp_core.figures import figures
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.records.grasps_json import load_grasps
from grasp_core.regions.certify_regions import certify_regions
from grasp_core.regions.proof import CertifiedRegions
from grasp_core.values import Grasp
from sim_validate.kit import command_flags
from sim_validate.kit.console import Reporter, finished
from sim_validate.kit.exit_codes import Exit
from sim_validate.kit.files import AboutObject
from sim_validate.kit.processes import each
from sim_validate.kit.result_folders import alone_in, remove_results
from sim_validate.planning.regions_json import GraspRegions, Regions, write_proof
from sim_validate.settings import Certifying


def certify_file(command: command_flags.Regions, reporter: Reporter) -> int:
    """Certify independent contact regions for a file's grasps, and write them with their proofs."""
    saved = load_grasps(command.grasps)
    chosen = [grasp for grasp in saved.grasps if command.grasp in (None, grasp.id)][: command.limit]
    if not chosen:
        wanted = f"a grasp {command.grasp}" if command.grasp else "at least one grasp"
        raise InputError(f"{command.grasps}: expected {wanted} to certify, found none")
    friction = saved.friction if command.friction is None else command.friction
    with alone_in(command.out):
        if command.out is not None:
            remove_results(command.out, "regions")
        found = certified(
            saved.body, chosen, friction, command.certifying, folder=command.out, jobs=command.jobs,
            reporter=reporter,
        )  # fmt: skip
    _show(found, reporter)
    reporter.document(found.document())
    proved = found.summary["proved"] == len(found.grasps)
    return Exit.GOOD if proved else Exit.NEGATIVE


def certified(
    body: Polyhedron, grasps: Sequence[Grasp], friction: float, asked: Certifying, *,
    folder: Path | None, jobs: int, reporter: Reporter,
) -> Regions:  # fmt: skip
    """Certify regions of grasps, in order; write each proof when it is ready, then regions.json.

    Nothing is written if `folder` is None.
    """
    proofs = each(partial(_certify, body, friction, asked), grasps, jobs=jobs)

    def recorded() -> Iterator[GraspRegions]:
        for grasp, proved in zip(grasps, proofs, strict=True):
            yield GraspRegions.of(grasp, proved, write_proof(folder, body, grasp, proved))

    results = reporter.counted(
        "certifying", recorded(), len(grasps), "proved", lambda one: one.regions is not None
    )
    collect = partial(Regions, AboutObject.of(body), friction, asked)
    return finished(results, len(grasps), collect, folder and folder / Regions.FILE, reporter)


def _certify(
    body: Polyhedron, friction: float, asked: Certifying, grasp: Grasp
) -> CertifiedRegions | str:
    left = friction * (1.0 - asked.reserve)
    try:
        if not force_closure(grasp.positions, grasp.normals, left).closed:
            return f"not in force closure at friction {left:.6g}"
        proved = certify_regions(
            body, grasp, friction, reserve=asked.reserve, recenter=asked.recenter,
            clearance=asked.edge_clearance_m, max_cones=asked.max_cones,
        )  # fmt: skip
    except (UndecidedError, SolverError) as error:
        return str(error)
    return "no radius could be proved" if proved is None else proved


def _show(found: Regions, reporter: Reporter) -> None:
    reporter.records("independent regions", found.grasps)
    for figure in figures(GraspRegions):
        if figure.meaning:
            reporter.say(f"{figure.shown.heading}: {figure.meaning}")
    reasons = Counter(each.reason for each in found.grasps if each.reason)
    for reason, count in reasons.most_common():
        reporter.say(f"no regions for {count} of {len(found.grasps)} grasps: {reason}")
    counted = [each.friction.min() for each in found.grasps if each.friction is not None]
    left = found.friction * (1.0 - found.certifying.reserve)
    if counted and min(counted) < left:
        reporter.say(
            f"the proofs use friction {min(counted):.4g} only, because curved faces lean from "
            "the planes that replace them"
        )


def wider(grasp: Grasp, found: GraspRegions) -> Grasp:
    """Give a grasp its certified regions if their discs around its contacts are larger."""
    if found.regions is None or found.normals is None:
        return grasp
    radius = min(
        _room(region.polygon, contact.position, normal)
        for region, contact, normal in zip(
            found.regions, grasp.contacts, found.normals, strict=True
        )
    )
    if radius <= grasp.radius and grasp.regions[0].kind != "point":
        return grasp
    return replace(grasp, regions=found.regions, radius=max(radius, 0.0))


def _room(polygon: Array, point: Array, normal: Array) -> float:
    """Compute how far a point lies from the nearest edge of a convex polygon (c, 3) [m]."""
    edges = np.roll(polygon, -1, axis=0) - polygon
    inward = np.cross(normal, edges)
    inward /= np.linalg.norm(inward, axis=1, keepdims=True)
    return float(np.einsum("ci,ci->c", inward, point - polygon).min())
