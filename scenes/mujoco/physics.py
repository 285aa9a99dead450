"""Writes what all scenes have in common: the simulator's settings, the object's mesh and body."""

from collections.abc import Mapping, Sequence

from grasp_core.arrays import Array, Indices
from scenes.mujoco.mjcf_text import COMPILER, Element, add_comment, add_element, element, printable
from scenes.settings import PhysicsSettings


def begin_scene(
    name: str, comment: str, physics: PhysicsSettings, radius_m: float,
    mesh: tuple[Array, Indices], *, flags: Mapping[str, str], solids: Sequence[Array] = (),
) -> tuple[Element, Element]:  # fmt: skip
    """Begin a scene: return its root, with all settings and the object's meshes, and its world.

    Takes corners (n, 3) and triangles (t, 3) of the mesh that is shown, and corners (n, 3) of each
    solid that is touched, about the centre of mass [m].
    """
    root = element("mujoco", {"model": printable(name)})
    add_comment(root, comment)
    add_element(root, "compiler", COMPILER)
    option = add_element(root, "option", physics.options())
    add_element(option, "flag", {**physics.flags(), **flags})
    add_element(root, "statistic", {"extent": 3.0 * radius_m, "center": (0.0, 0.0, 0.0)})
    assets = add_element(root, "asset", {})
    seen = {"vertex": mesh[0].ravel(), "face": mesh[1].ravel()}
    add_element(assets, "mesh", {"name": "object", "inertia": "shell"} | seen)
    for place, corners in enumerate(solids):
        solid = {"name": f"surface{place}", "inertia": "shell", "vertex": corners.ravel()}
        add_element(assets, "mesh", solid)
    return root, add_element(root, "worldbody", {})


def add_light(world: Element, radius_m: float) -> None:
    """Add the light above an object."""
    light = {"pos": (0.0, 0.0, 8.0 * radius_m), "dir": (0.0, 0.0, -1.0), "type": "directional"}
    add_element(world, "light", light)


def add_free_body(
    world: Element, mass_kg: float, inertia: Array, center: object = (0.0, 0.0, 0.0),
    more: Mapping[str, object] | None = None,
) -> Element:  # fmt: skip
    """Add the object's body, which moves freely, with its mass and inertia (3, 3) [kg m^2]."""
    place = {"name": "object", "pos": (0.0, 0.0, 0.0), **(more or {})}
    body = add_element(world, "body", place)
    add_element(body, "freejoint", {"name": "object"})
    six = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    add_element(body, "inertial", {"pos": center, "mass": mass_kg, "fullinertia": six})
    return body
