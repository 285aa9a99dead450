"""Exports grasps of a dataset as MuJoCo scenes with keyframes, one file each."""

from collections.abc import Callable
from pathlib import Path

from grasp_core.files.text_files import write_text
from scenes.mjcf import build_scene
from sim_validate.datasets.columns import Name
from sim_validate.datasets.exports.stored_grasps import grasped_objects, is_grasp, new_path
from sim_validate.datasets.open_dataset import Selection


def write_mjcf(
    chosen: Selection, folder: Path, report: Callable[[int, int], None]
) -> dict[Name, int]:
    """Write the MuJoCo scene of each grasp, rebuilt from its mesh and contacts."""
    total = sum(map(is_grasp, chosen.rows("grasps")))
    objects = grasps = 0
    for each in grasped_objects(chosen):
        objects += 1
        for grasp in each.grasps:
            scene = build_scene(each.body, grasp.contacts, grasp.friction)
            write_text(new_path(folder, grasp.id, "xml"), scene.xml)
            grasps += 1
            report(grasps, total)
    return {"objects": objects, "grasps": grasps}
