"""Writes the poses that `reach` found as records of DexGraspBench."""

from collections.abc import Sequence
from pathlib import Path

from grasp_core.by_value import counted
from grasp_core.hands.hand import Hand
from grasp_core.hands.reach import HandReach
from grasp_core.objects.polyhedron import Polyhedron, is_convex
from sim_validate.cli.console import Reporter
from sim_validate.peer_files.dexgraspbench_records import write_dex_record
from sim_validate.peer_files.hand_records import dex_record
from sim_validate.peer_files.object_folders import write_dex_object


def write_records(
    folder: Path, hand: Hand, body: Polyhedron, found: Sequence[HandReach], reporter: Reporter
) -> None:
    """Write a record for each grasp that is reached, and the object if it is convex."""
    place = folder / "object"
    if is_convex(body):
        write_dex_object(body, place)
    else:
        reporter.warn(
            f"{body.name} is not convex: let MeshProcess write {place} from its mesh, as "
            "DexGraspBench simulates convex pieces"
        )
    reached = [each for each in found if each.reached]
    for each in reached:
        record = dex_record(hand, each, str(place.resolve()))
        write_dex_record(record, folder / "graspdata" / f"{each.grasp}.npy")
    reporter.say(f"wrote {counted(len(reached), 'record')} of DexGraspBench to {folder}")
