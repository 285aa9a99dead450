"""Pictures of grasps can be read: from a good side, nothing cut off."""

import io
import itertools

import numpy as np
import pytest
import trimesh
from PIL import Image, ImageFont

import grasp_core as gc
import scenes
from grasp_core.errors import InputError
from grasp_core.geometry.polygons import convex_hull, signed_area
from scenes.drawing.painting import (
    FORESHORTENED,
    Camera,
    DrawnSurface,
    Window,
    best_view,
    outline,
    painted,
)
from scenes.drawing.panels import width_of
from scenes.drawing.pictures import BAR_RADIUS, Drawing, glass, grasp_figure, write_picture
from scenes.drawing.sheets import ASSETS, FONT_FILES, PICTURE_FORMATS, Area, Sheet, Words, png_of
from tests.scenes.drawing.whole import assert_whole
from tests.sim_validate.rigs import grasps


@pytest.fixture(scope="module")
def wedge():
    body, (grasp,) = grasps("wedge", 0.5, 1, ("pencil",))
    return body, grasp


@pytest.mark.parametrize("name", ["wedge", "double-wedge-bar"])
def test_no_finger_points_at_the_viewer(name):
    """A bar that is seen at FORESHORTENED + 0.1 is still 0.33 object radii long: 0.75 of them
    times the sine of 26 degrees. Contacts are a bar's width apart.
    """
    body, found = grasps(name, 0.5, 3, ("concurrent", "pencil"), cones="tilted")
    assert len(found) == 3
    for grasp in found:
        view = best_view(body, grasp)
        assert np.abs(grasp.normals @ view.axes[2]).max() < FORESHORTENED + 0.1
        places, _ = view.seen(grasp.positions)
        gaps = [np.linalg.norm(a - b) for a, b in itertools.combinations(places, 2)]
        assert min(gaps) > BAR_RADIUS * body.radius


def test_nothing_is_cut_off():
    for family in ("concurrent", "pencil", "regulus"):
        body, (grasp,) = grasps("tetrahedron", 0.3, 1, (family,), cones="tilted")
        assert_whole(grasp_figure(body, grasp, 0.3, legend=True))


def test_every_finger_is_seen(wedge, monkeypatch):
    """The picture changes where a bar is left out.

    A bar 0.1 by 0.75 finger sizes that is seen at the worst angle covers 0.033 square sizes. The
    finger size is 0.59 radii or more, so in a picture of at most 3.7 radii the bar fills 0.085 %.
    """
    body, grasp = wedge
    whole = pixels_of(grasp_figure(body, grasp, 0.5, legend=False))
    for finger in range(4):
        shapes = [shape for shape in Drawing(body, grasp, 0.5).shapes()
                  if (shape.role, shape.finger) != ("finger", finger)]  # fmt: skip
        monkeypatch.setattr(Drawing, "shapes", lambda _, left=shapes: left)
        figure = grasp_figure(body, grasp, 0.5, legend=False)
        monkeypatch.undo()
        changed = np.abs(whole - pixels_of(figure)).max(axis=2) > 0.15
        assert changed.mean() > 0.0008


def pixels_of(figure):
    with Image.open(io.BytesIO(png_of(figure))) as picture:
        return np.asarray(picture.convert("RGB")) / 255.0


def test_a_picture_has_letters_where_a_machine_has_no_fonts():
    """Its fonts hold every sign that drawings use, and no letter is wider than is reckoned with."""
    said = "Simulated 0.5 µm, 90° “±” ≤ 1 Φ"
    for bold, name in zip((False, True), FONT_FILES, strict=True):
        font = ImageFont.truetype(ASSETS / name, 100)
        assert all(font.getmask(letter).getbbox() for letter in said if letter != " ")
        if not bold:
            assert font.getlength(said) <= width_of(said, 100.0)
        drawn = pixels_of(Sheet(300.0, 30.0, "words", (Words(5.0, 15.0, said, bold=bold),)))
        assert (drawn.min(axis=2) < 0.5).sum() > 300


def test_a_curved_body_has_an_outline_and_no_seams(monkeypatch):
    """A ball is drawn with no edge; its outline is the circle where the line of sight grazes it."""
    ball = trimesh.creation.icosphere(subdivisions=3)
    body = gc.Polyhedron.from_mesh(ball.vertices, ball.faces, faces="patches")
    surface, edges = glass(body)
    assert not edges.lines
    with monkeypatch.context() as patch:  # fine surfaces are drawn coarser and stay where they are
        patch.setattr("scenes.drawing.pictures.MOST_TRIANGLES", 300)
        coarser = glass(body)[0]
    assert 50 < len(coarser.polygons) < len(surface.polygons)
    far = np.linalg.norm(coarser.vertices() - body.center_of_mass, axis=1)
    assert 0.85 * body.radius < far.min() <= far.max() <= (1.0 + 1e-9) * body.radius
    view = Camera.of_angles(20.0, 30.0, body)
    lines = outline(DrawnSurface.of(surface.polygons), view.camera)
    assert len(lines) > 30
    heights = (lines.reshape(-1, 3) - body.center_of_mass) @ view.axes[2] / body.radius
    # the camera is nine radii away: the tangents touch at a ninth, here to an edge's length
    assert np.abs(heights - 1.0 / 9.0).max() < 0.2
    window = Window.around([surface], np.empty((0, 3)), body, view, 500.0)
    areas = [part for part in painted((surface,), window) if isinstance(part, Area)]
    assert 2 <= len(areas) <= 14  # two sides, at most seven shades each
    flat, _ = window.seen(surface.vertices())
    covered = sum(abs(signed_area(loop)) for area in areas for loop in area.loops)
    assert covered == pytest.approx(2.0 * abs(signed_area(convex_hull(flat))), rel=0.35)


@pytest.mark.parametrize("form", PICTURE_FORMATS)
def test_a_picture_is_the_same_each_time(wedge, tmp_path, form):
    one, two = (write_picture(*wedge, tmp_path / place / f"a.{form}").read_bytes()
                for place in ("one", "two"))  # fmt: skip
    assert one == two
    assert len(one) > 5000
    if form == "png":
        with Image.open(io.BytesIO(one)) as picture:
            assert min(picture.size) >= 500


def test_what_is_no_grasp_of_the_object_is_refused(wedge, tmp_path):
    _, grasp = wedge
    with pytest.raises(InputError, match="does not lie on face"):
        write_picture(scenes.example_object("box"), grasp, tmp_path / "a.png")
