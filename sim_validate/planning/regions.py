"""Runs the command `regions`, which proves where each finger of a grasp may stand."""

from collections import Counter
from collections.abc import Mapping
from typing import Any

from grasp_core.errors import InputError
from sim_validate.kit import command_flags
from sim_validate.kit.console import TABLE_ROWS, Reporter, say_cut
from sim_validate.kit.exit_codes import Exit
from sim_validate.kit.result_folders import alone_in, remove_results
from sim_validate.planning.certifying import Asked, certified
from sim_validate.planning.grasps_json import read_grasps
from sim_validate.planning.regions_json import REGIONS, write_regions

MILLI = 1e3


def certify_file(command: command_flags.Regions, reporter: Reporter) -> int:
    """Certify independent contact regions for a file's grasps, and write them with their proofs."""
    saved = read_grasps(command.grasps)
    chosen = [grasp for grasp in saved.grasps if command.grasp in (None, grasp.id)][: command.limit]
    if not chosen:
        wanted = f"a grasp {command.grasp}" if command.grasp else "at least one grasp"
        raise InputError(f"{command.grasps}: expected {wanted} to certify, found none")
    asked = Asked(
        saved.friction if command.friction is None else command.friction,
        command.reserve, command.recenter, command.edge_clearance_m,
        command.max_cones,
    )  # fmt: skip
    with alone_in(command.out):
        if command.out is not None:
            remove_results(command.out, "regions")
        with reporter.progress("certifying") as steps:
            found = certified(saved.body, chosen, asked, jobs=command.jobs, progress=steps.update)
            document = write_regions(command.out, saved.body, asked, found)
    _show(document, reporter)
    if command.out is not None:
        reporter.say(f"wrote {command.out / REGIONS}")
    reporter.document(document)
    proved = all(grasp["regions"] is not None for grasp in document["grasps"])
    return Exit.GOOD if proved else Exit.NEGATIVE


def _show(document: Mapping[str, Any], reporter: Reporter) -> None:
    grasps = document["grasps"]
    columns = ("grasp", "family", "planned mm", "disc mm", "open mm", "inner mm", "mm2", "cones")
    reporter.table("independent regions", columns, [_row(grasp) for grasp in grasps[:TABLE_ROWS]])
    say_cut(len(grasps), reporter)
    reporter.say(
        "disc: proved radius around contacts or face middles, cut off at face borders; open: a "
        "larger radius, at which some choice of contacts is not in force closure; inner: smallest "
        "of the discs inscribed in the regions; mm2: area of the regions; cones: size of the proof"
    )
    reasons = Counter(grasp["reason"] for grasp in grasps if grasp["regions"] is None)
    for reason, count in reasons.most_common():
        reporter.say(f"no regions for {count} of {len(grasps)} grasps: {reason}")
    counted = [mu for grasp in grasps if grasp["regions"] for mu in grasp["friction"]]
    left = document["friction"] * (1.0 - document["reserve"])
    if counted and min(counted) < left:
        reporter.say(
            f"the proofs use friction {min(counted):.4g} only, because curved faces lean from "
            "the planes that replace them"
        )


def _row(grasp: Mapping[str, Any]) -> tuple[str, ...]:
    named = (grasp["id"], grasp["family"], _millimetres(grasp["planned_radius_m"] or None))
    if grasp["regions"] is None:
        return (*named, "none", "", "", "", "")
    regions = grasp["regions"]
    return (
        *named,
        _millimetres(grasp["disc_radius_m"]),
        _millimetres(grasp["open_radius_m"]),
        _millimetres(min(region["inscribed_radius_m"] for region in regions)),
        f"{MILLI**2 * sum(region['area_m2'] for region in regions):.4g}",
        str(grasp["cones"]),
    )


def _millimetres(length: float | None) -> str:
    return "-" if length is None else f"{MILLI * length:.3g}"
