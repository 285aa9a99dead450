"""Writes grasps for MoveIt as YAML, with PyYAML: ROS messages, and what they have no fields for.

`graspable_object` has the fields of a grasping_msgs/GraspableObject (see `ros_messages`). Such a
message says nothing about points on the object: contacts, normals, each finger's approach and the
figures of each grasp are under `fingertips`.
"""

import importlib
from collections.abc import Mapping
from typing import Any

from grasp_core.errors import InputError
from grasp_core.objects.polyhedron import Polyhedron
from scenes.exports.placed_grasps import PlacedGrasp
from scenes.exports.ros_messages import graspable_object

HEAD = """\
# Grasps by four spherical fingertips: metres, newtons, vectors in the frame of the object.
# graspable_object: a grasping_msgs/GraspableObject for a hand with joints fingerI_x, _y and _z.
# fingertips: what such messages have no fields for.
"""
WIDTH = 120
"""Number of columns after which lists are broken."""


def yaml_text(body: Polyhedron, grasps: tuple[PlacedGrasp, ...]) -> str:
    """Return the text of a YAML file; equal grasps give equal text."""
    try:
        yaml: Any = importlib.import_module("yaml")
    except ImportError as error:
        raise InputError(
            "writing YAML needs PyYAML: run pip install 'graspproof[moveit]' ('.[moveit]' in a "
            "checkout), or take another format"
        ) from error
    document = {
        "graspable_object": graspable_object(body, grasps),
        "fingertips": [_fingertips(placed) for placed in grasps],
    }
    # meshes make long files, for which PyYAML has a compiled writer on most machines
    dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
    return HEAD + yaml.dump(
        document, Dumper=dumper, sort_keys=False, width=WIDTH, default_flow_style=None,
        allow_unicode=True,
    )  # fmt: skip


def _fingertips(placed: PlacedGrasp) -> Mapping[str, object]:
    ways = placed.rods[:, :3, 2].tolist()
    return {
        **placed.figures,
        "fingertip_radius_m": placed.tip_radius,
        "contacts": [
            {
                "position_m": contact.position.tolist(),
                "normal": contact.normal.tolist(),
                "approach_direction": way,
            }
            for contact, way in zip(placed.grasp.contacts, ways, strict=True)
        ],
    }
