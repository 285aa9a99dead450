"""Draws the motion of a scene as a clip, in a separate process, where graphics are available.

The object in a good grasp moves by micrometres, so motions can be shown magnified: all of them by
one factor from the first sample, so that one still sees which parts move together.
"""

import importlib
import importlib.util
import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array
from grasp_core.errors import GraspError, InputError
from grasp_core.files.text_files import write_parts
from scenes.drawing.sheets import FINGER_COLOURS, rgb
from scenes.mujoco.closure_scene import Scene
from scenes.mujoco.held_scene import HeldScene

CLIP_TYPES = (".gif", ".webp")
ANGLES_DEG = (-50.0, 25.0)
SIZE = (480, 360)
"""Width and height of the picture [pixels]."""
RATE = 25.0
SLOWER = 1.0 / (RATE * 0.01)
"""Factor by which clips of trials are slower than reality, with a sample of 10 ms in each frame."""
SHOWN_REACH = 0.9
"""Share of the fingertips' farthest reach that the picture must show: fingertips may come nearer to
the picture's border than the object."""
UPWARD = np.array([0.0, 0.0, 1.0])
RIGID = 7
"""Length of each row of joint positions in a scene with rigid fingertips, which holds only the pose
of the object."""
VISIBLE = 0.1
"""Size, in grasp sizes, to which small motions are magnified so that they are easily seen."""
MOST_ENLARGED = 1000.0
PATIENCE_S = 300.0


class GraphicsError(GraspError):
    """Raised when this machine lacks what clips are drawn with."""


def write_clip(
    scene: Scene, joints: Array, path: Path, caption: str, *, angles_deg: ArrayLike = ANGLES_DEG
) -> Path:
    """Draw the motion of a scene, joints (n, 7 + 3k), one frame for each sample."""
    layout = scene.layout
    tips = layout.holder.tips(joints[:, RIGID:])
    farthest = float(np.linalg.norm(tips, axis=2).max()) + layout.drive.radius_m
    shown = max(layout.radius_m, SHOWN_REACH * farthest)
    return _written(path, xml=scene.xml, joints=joints, radius=shown, caption=caption,
                    angles=np.broadcast_to(angles_deg, (len(joints), 2)))  # fmt: skip


def write_trial_clip(scene: Scene, joints: Array, path: Path, name: str) -> Path:
    """Draw the magnified motion of a trial as far as it is finite; its caption says the factors."""
    known = np.isfinite(joints).all(axis=1)
    if not known.any():
        raise GraphicsError(f"{name}: nothing finite to draw")
    larger, factor = magnified(joints[known], scene)
    motion = f"motion {factor:g} times as large" if factor > 1.0 else "true to scale"
    return write_clip(scene, larger, path, f"{name}, {motion}, {SLOWER:g} times slower")


def write_held_clip(
    scene: HeldScene, joints: Array, path: Path, caption: str, *,
    table: tuple[Array, Array] | None = None, up: Array = UPWARD,
) -> Path:  # fmt: skip
    """Draw the motion of a held object and its palm, joints (n, 13 + 3k)."""
    layout = scene.layout
    rotation: Any = importlib.import_module("scipy.spatial.transform").Rotation
    turn = rotation.align_vectors(UPWARD[None], up[None])[0]
    drawn = joints.copy()
    drawn[:, :3] = turn.apply(joints[:, :3])
    drawn[:, 3:RIGID] = _turned(turn, joints[:, 3:RIGID])
    path_of_palm = turn.apply(joints[:, RIGID : RIGID + 3])
    tips = np.linalg.norm(layout.tip_centers, axis=1) + layout.tip_radius_m
    low, high = path_of_palm.min(axis=0), path_of_palm.max(axis=0)
    shown = max(layout.radius_m, SHOWN_REACH * float(tips.max()))
    parts = {"middle": 0.5 * (low + high), "palm": turn.as_quat(scalar_first=True)}
    if table is not None:
        place, quaternion = table
        parts["table"] = np.concatenate([turn.apply(place), _turned(turn, quaternion)])
    radius = shown + 0.5 * float(np.linalg.norm(high - low))
    return _written(path, xml=scene.xml, joints=drawn, radius=radius, caption=caption,
                    angles=np.broadcast_to(ANGLES_DEG, (len(joints), 2)), **parts)  # fmt: skip


def _turned(turn: Any, quaternions: Array) -> Array:
    """Turn orientations, given as quaternions (w, x, y, z), (..., 4), by a rotation."""
    rotation: Any = importlib.import_module("scipy.spatial.transform").Rotation
    return (turn * rotation.from_quat(quaternions, scalar_first=True)).as_quat(scalar_first=True)


def _written(path: Path, **job_parts: Any) -> Path:
    if path.suffix.lower() not in CLIP_TYPES:
        raise InputError(f"{path}: a clip's name must end in {' or '.join(CLIP_TYPES)}")
    if importlib.util.find_spec("PIL") is None:
        raise GraphicsError(
            "clips need Pillow: run pip install 'graspproof[clips]' ('.[clips]' in a checkout)"
        )
    with tempfile.TemporaryDirectory() as folder:
        job, out = Path(folder) / "job.npz", Path(folder) / f"clip{path.suffix.lower()}"
        colours = [rgb(colour) for colour in FINGER_COLOURS]
        np.savez(job, size=SIZE, rate=RATE, colours=colours, **job_parts)
        said = ""
        for graphics in _graphics():
            said = _run_frames(graphics, [str(job), str(out)])
            if not said and out.is_file():
                return write_parts(path, [out.read_bytes()])
            said = said or f"{graphics}: nothing was drawn"
    raise GraphicsError(f"MuJoCo cannot draw on this machine: {said}; {remedy()}")


def available_graphics() -> str:
    """Return the name of the graphics library that MuJoCo can draw with here."""
    said = list[str]()
    for graphics in _graphics():
        trouble = _run_frames(graphics, [])
        if not trouble:
            return graphics
        said.append(trouble)
    raise GraphicsError("; ".join(said))


def remedy() -> str:
    """Advise what to do on a machine where nothing can be drawn."""
    if (chosen := os.environ.get("MUJOCO_GL")) is not None:
        return f"unset MUJOCO_GL, which is {chosen!r}, so that other graphics libraries are tried"
    return "install libegl1 or libosmesa6, or use a display"


def has_display() -> bool:
    """Return whether there is a display on which MuJoCo's viewer can open."""
    if sys.platform != "linux":
        return True
    return any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))


def _graphics() -> Iterator[str]:
    chosen = os.environ.get("MUJOCO_GL")
    if chosen is not None:
        yield chosen
    elif sys.platform == "linux":
        yield from ("egl", "osmesa", *(["glfw"] if os.environ.get("DISPLAY") else []))
    else:
        yield ""


def _run_frames(graphics: str, arguments: list[str]) -> str:
    """Run the drawing program; return what went wrong, or an empty text."""
    program = str(Path(__file__).with_name("frames.py"))
    command = [sys.executable, "-P", program, *arguments]
    settings = {**os.environ, "MUJOCO_GL": graphics}
    try:
        ran = subprocess.run(  # noqa: S603 - our own program
            command, env=settings, capture_output=True, timeout=PATIENCE_S, check=False
        )
    except subprocess.TimeoutExpired:
        return f"{graphics} took more than {PATIENCE_S:g} s"
    if ran.returncode == 0:
        return ""
    words = ran.stderr.decode(errors="replace").strip().splitlines()
    return f"{graphics}: {words[-1] if words else f'ended with {ran.returncode}'}"


def magnified(joints: Array, scene: Scene) -> tuple[Array, float]:
    """Magnify motions since the first sample, (n, 7 + 3k), until they can be seen.

    Gives also the one factor by which they are larger: of one significant digit, at least 1.
    """
    center, size = scene.layout.center, scene.layout.grasp_size_m
    rotation: Any = importlib.import_module("scipy.spatial.transform").Rotation
    poses = rotation.from_quat(joints[:, 3:7], scalar_first=True)
    turns = (poses * poses[0].inv()).as_rotvec()
    centers = joints[:, :3] + poses.apply(center)
    shifts, slides = centers - centers[0], joints[:, 7:] - joints[0, 7:]
    largest = float((np.linalg.norm(shifts, axis=1) + size * np.linalg.norm(turns, axis=1)).max())
    factor = max(VISIBLE * size / max(largest, VISIBLE * size / MOST_ENLARGED), 1.0)
    power = 10.0 ** math.floor(math.log10(factor))
    factor = math.floor(factor / power) * power
    larger = rotation.from_rotvec(factor * turns)
    places = center + factor * shifts - larger.apply(center)
    quaternions = larger.as_quat(scalar_first=True)
    return np.column_stack([places, quaternions, factor * slides]), factor
