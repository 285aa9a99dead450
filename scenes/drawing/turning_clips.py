"""Draws a clip of a grasp's picture that turns around once, without any graphics library."""

from pathlib import Path

from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Grasp
from scenes.drawing.canvas import draw_sheet, new_figure, write_frames
from scenes.drawing.clips import require_clip
from scenes.drawing.pictures import SIDE, grasp_sheet
from scenes.drawing.views import View

FRAMES, RATE = 48, 12.0
"""Frames in one turn, and frames per second."""
ELEVATION_DEG = 25.0


def write_turning_clip(body: Polyhedron, grasp: Grasp, path: Path, friction: float) -> Path:
    """Draw a grasp from all sides and write the pictures as a clip that turns around once."""
    require_clip(path)
    figure = new_figure(SIDE, SIDE)
    views = [View.of_angles(360.0 * frame / FRAMES, ELEVATION_DEG, body) for frame in range(FRAMES)]

    def draw(frame: int) -> None:
        sheet = grasp_sheet(body, grasp, friction, view=views[frame], steady=True)
        draw_sheet(figure, sheet)

    return write_frames(figure, draw, FRAMES, RATE, path)
