"""Finds the object of a record in a scene, as BODex and Dexonomy write scenes.

A scene is a dictionary: `scene` has an entry for each body (`scale`, `pose`, `file_path`), and
`task` says in `obj_name` which of them is grasped. A record has it as `scene_cfg`, or names in
`scene_path` a `.npy` file with it. That file is looked for in every folder above the records and
above the objects, by its whole path or from its folder `scene_cfg` on. BODex has the bodies as
`world_cfg`, with the name of the grasped one beside it. Objects are named by the folder that holds
the folder of their mesh, as in DexGraspBench.
"""

import posixpath
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, cast

from grasp_core.errors import InputError, about
from grasp_core.files.json_text import shown
from grasp_core.files.text_files import read_bytes
from sim_validate.files.numpy_pickles import MOST_PICKLE_BYTES, unpickled
from sim_validate.judge.formats.fields import Source, entry, text

PLACE = ("obj_scale", "obj_pose")
FIELDS = (
    *PLACE, "obj_path", "scene_scale", "world_cfg", "manip_name", "scene_cfg", "scene_path",
    "joint_names", "pregrasp_qpos", "grasp_qpos", "squeeze_qpos",
)  # fmt: skip
"""Fields that are looked at; a dictionary may have any number of others."""
SCENE_FOLDER = "scene_cfg/"


def object_of(table: Any, source: Source) -> Mapping[str, Any]:
    """Return the fields of a record with those of its object, as DexGraspBench names them."""
    if not isinstance(table, dict):
        raise InputError(f"expected the dictionary of a grasp, got {shown(table)}")
    fields = cast("dict[str, Any]", table)
    told, path = {name: fields[name] for name in FIELDS if name in fields}, ""
    placed = all(name in told for name in PLACE)
    if placed and "obj_path" in told:
        return told
    if "world_cfg" in told:
        body = entry(entry(told["world_cfg"], "mesh"), text(told, "manip_name"))
    elif "scene_cfg" in told:
        body = _grasped(told["scene_cfg"])
    elif "scene_path" in told:
        path = text(told, "scene_path").replace("\\", "/")
        if placed:
            return {**told, "obj_path": path.rpartition(SCENE_FOLDER)[2].split("/")[0]}
        body = _grasped(_scene(path, source))
    else:
        raise InputError("expected obj_path, obj_scale and obj_pose, or scene_path; add them")
    older = isinstance(body, dict) and "file_path" not in body
    mesh = text(body, "urdf_path" if older else "file_path").replace("\\", "/")
    mesh = posixpath.normpath(posixpath.join(posixpath.dirname(path), mesh))
    return {
        "obj_path": posixpath.dirname(posixpath.dirname(mesh)),
        "obj_scale": entry(body, "scale"), "obj_pose": entry(body, "pose"),
    } | told  # fmt: skip


def _grasped(scene: Any) -> Any:
    """Return what a scene says of the body that is grasped."""
    if isinstance(scene, dict) and "interest_obj_name" in scene:  # Dexonomy's older scenes
        name = text(scene, "interest_obj_name")
    else:
        name = text(entry(scene, "task"), "obj_name")
    return entry(entry(scene, "scene"), name)


def _scene(path: str, source: Source) -> Any:
    place = next(_places(path, source), None)
    if place is None:
        raise InputError(
            f"the scene {shown(path)} is not in a folder above the records or the objects; put it "
            "there, or write obj_path, obj_scale and obj_pose into the records"
        )
    with about(place):
        return unpickled(read_bytes(place, MOST_PICKLE_BYTES))


def _places(path: str, source: Source) -> Iterator[Path]:
    _, folder, end = path.rpartition(SCENE_FOLDER)
    starts = [source.path, *([] if source.objects is None else [source.objects / "any"])]
    for above in [above for start in starts for above in start.absolute().parents]:
        for named in (path, folder + end):
            with suppress(OSError, ValueError):  # no name of a file
                if (above / named).is_file():
                    yield above / named
