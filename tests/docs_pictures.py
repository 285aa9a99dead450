"""The pictures of the README and of docs/: `python -m tests.docs_pictures` makes them again.

Names of pictures after the command choose some of them.
"""

import io
import math
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import trimesh
from PIL import Image

import grasp_core as gc
import scenes
from scenes.drawing.painting import Camera, Drawable, best_view
from scenes.drawing.panels import Axis, KeyLine, Panel, keyed
from scenes.drawing.pictures import (
    CONE_LENGTH,
    PIXELS,
    Drawing,
    cone_sides,
    finger_size,
    glass,
    grasp_figure,
    pin,
    sheet_of,
)
from scenes.drawing.sheets import (
    BAD_HEX,
    FINGER_COLOURS,
    GLASS,
    INK_HEX,
    Area,
    Dots,
    Line,
    Sheet,
    Words,
    beside,
    moved,
    numbered,
    outlined,
    png_of,
)
from scenes.settings import SAMPLE_S
from sim_validate.closure.controls import negative_controls
from sim_validate.closure.replaying import Recorded, replayed
from sim_validate.engine.setup import Agenda, Setup
from sim_validate.execution.confirming import run_trials
from sim_validate.execution.execute import SpringFingers
from sim_validate.execution.holders import planned
from sim_validate.execution.simulate import HeldBench
from sim_validate.report.charts import (
    Agreement,
    fidelity_panel,
    margin_figure,
    motion_panels,
    wrench_figure,
)
from sim_validate.settings import TRIAL_KINDS, ExecutionSettings
from tests.scenes.drawing.standing import standing

FOLDER = Path(__file__).parent.parent / "docs" / "pictures"
BENCHMARKS = FOLDER.parent / "benchmarks.md"
TEN_DEGREES = math.tan(math.radians(10.0))
FAMILIES = (
    ("dodecahedron", "concurrent", TEN_DEGREES, "normal"),
    ("double-wedge-bar", "pencil", TEN_DEGREES, "normal"),
    ("icosahedron", "regulus", 0.3, "tilted"),
)
FRICTION = 0.5
MASSES_KG = (0.3, 1.0, 1.5)
TITLE = 24.0
"""Height of a line for a title [pixels]."""


def best(name, family, friction, cones="tilted"):
    body = scenes.example_object(name)
    plan = gc.plan(
        body, friction, families=(family,), limit=1, settings=gc.PlanSettings(cones=cones)
    )
    return body, plan.grasps[0]


def families():
    """A grasp of each of the paper's families, side by side."""
    sheets = []
    for case in FAMILIES:
        sheets.append(titled(Drawing(*best(*case), case[2]).sheet(), case[1]))
    return beside(sheets)


def grasp():
    """One grasp, with all that its picture explains."""
    return grasp_figure(*best("wedge", "pencil", FRICTION), FRICTION)


def hand():
    """A hand that stands in a grasp, from a stored pose."""
    body, grasp, held, reach = standing()
    return grasp_figure(body, grasp, FRICTION, hand=held, reach=reach)


def regions():
    """Certified regions of a regulus, for which the paper has none."""
    body, grasp = best("octahedron", "regulus", FRICTION)
    found = gc.certify_regions(body, grasp, FRICTION, max_cones=1250)
    return grasp_figure(body, replace(grasp, regions=found.regions), FRICTION)


def certificate():
    """Contacts in a plane whose forces can balance, and contacts whose forces cannot."""
    kept = planar(0.2, "force closure: forces in the cones balance")
    lost = planar(-0.55, "none: every force turns the object to the left", turning=True)
    return beside([kept, lost])


def planar(aside, title, *, turning=False):
    """Four fingers at the sides of a square, each beside the middle of its side by a share.

    Opposite fingers push along one line, or all of them push the same way round if `turning`.
    """
    half, friction, middle = 95.0, 0.35, np.array([190.0, 190.0])
    square = half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    marks = [Area((middle + square,), GLASS, 0.25), outlined([middle + square], INK_HEX, 1.2)]
    for finger, colour in enumerate(FINGER_COLOURS):
        normal = np.array([(1, 0), (-1, 0), (0, 1), (0, -1)][finger])
        along = np.array([-normal[1], normal[0]])
        side = 1.0 if turning or finger < 2 else -1.0
        at = middle - half * (normal + side * aside * along)
        cone = [at + 80.0 * (normal + slope * friction * along) for slope in (-1, 1)]
        marks += [Area((np.array([at, *cone]),), colour, 0.35), Dots(at[None], INK_HEX, 3.0)]
        marks += numbered(at - 24.0 * normal, 11.0, str(finger), colour)
        if not turning:
            force = 62.0 * (normal + side * aside * along)
            marks += arrow(np.array([at, at + force]), colour)
    if turning:
        angles = np.linspace(0.3, -4.4, 60)
        marks += arrow(middle + 34.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1), INK_HEX)
    name = Words(middle[0], 362.0, title, "middle", 14.0)
    return Sheet(380.0, 380.0, title, (*marks, name))


def arrow(path, colour):
    """A line with a head at its end."""
    end, along = path[-1], (path[-1] - path[-2]) / np.linalg.norm(path[-1] - path[-2])
    across = np.array([-along[1], along[0]])
    head = np.array([end + 10.0 * along, end + 5.0 * across, end - 5.0 * across])
    return [Line((path,), colour, 2.5), Area((head,), colour)]


def wrenches():
    return wrench_figure(*best("wedge", "pencil", FRICTION), FRICTION)


def margins():
    return margin_figure(*best("wedge", "pencil", FRICTION), FRICTION)


def motion():
    body, grasp = best("wedge", "pencil", FRICTION)
    setup = Setup()
    found = replayed(
        Recorded(grasp.id, body, grasp.contacts, FRICTION, setup, Agenda(), grasp=grasp)
    )
    threshold = setup.hold.hold_threshold * found.scene.layout.grasp_size_m
    return beside(motion_panels(found, threshold))


def fidelity():
    """Critical friction of grasps of four objects, as predicted and as found in simulation."""
    import sim_validate as sv

    pairs = []
    for name in ("wedge", "dodecahedron", "double-wedge-bar", "box"):
        body = scenes.example_object(name)
        for grasp in gc.plan(body, FRICTION, limit=8).grasps:
            found = sv.simulated_critical_friction(body, grasp)
            if grasp.critical_friction > 1e-3:
                pairs.append((grasp.critical_friction, found))
    return fidelity_panel(Agreement("critical friction", tuple(pairs)))


def misplaced():
    """Share of misplaced objects that are kept, from the table of the benchmarks' page."""
    header, _, *rows = kept_by_distance()
    distances = np.array([float(cell) for cell in header[1:]])
    panel = Panel(70.0, 28.0, 500.0, 240.0, Axis(0.0, float(distances.max())), Axis(0.0, 1.02))
    marks = [*panel.frame(distances.tolist(), (0.0, 0.25, 0.5, 0.75, 1.0), ".0%")]
    for colour, (_, *cells) in zip(FINGER_COLOURS, rows, strict=True):
        counts = np.array([[int(part) for part in cell.split(" of ")] for cell in cells])
        shares = counts[:, 0] / counts[:, 1]
        marks += [
            panel.curve(distances, shares, colour),
            Dots(panel.at(distances, shares), colour, 3.5),
        ]
    key = [KeyLine(row[0], colour) for colour, row in zip(FINGER_COLOURS, rows, strict=True)]
    below, _ = keyed(key, 70.0, 325.0, 500.0)
    names = panel.named("misplaced objects", "distance from the expected place [mm]", "share kept")
    return Sheet(600.0, 350.0, "share kept", (*marks, *names, *below))


def placement():
    """Proved chance of closure of an icosahedron's grasps, by how far the object is off."""
    body, sizes = scenes.example_object("icosahedron"), np.arange(0.5, 6.1, 0.5)
    panel = Panel(70.0, 28.0, 500.0, 240.0, Axis(0.0, 6.0), Axis(0.0, 1.02))
    marks = [*panel.frame(np.arange(7.0), (0.0, 0.25, 0.5, 0.75, 1.0), ".2f")]
    methods = ("concurrent", "pencil", "regulus", "free")
    for method, colour, dot in zip(methods, FINGER_COLOURS, (6.0, 3.5, 3.5, 3.5), strict=True):
        grasp = gc.plan(body, FRICTION, families=method, limit=1).grasps[0]
        chances = []
        for size in sizes:
            off = {"pose_sigma_m": 1e-3 * size, "pose_sigma_rad": math.radians(size)}
            found = gc.placement_probability(body, grasp, (FRICTION, 0.05), **off)
            chances.append(0.0 if found is None else found.lower)
        places = panel.at(sizes, np.array(chances))
        marks += [panel.curve(sizes, np.array(chances), colour), Dots(places, colour, dot)]
    key = [KeyLine(name, colour) for name, colour in zip(methods, FINGER_COLOURS, strict=True)]
    below, _ = keyed(key, 70.0, 325.0, 500.0)
    names = panel.named(
        "object off its planned place", "standard deviation [mm and degrees]", "closed at least"
    )
    return Sheet(600.0, 350.0, "closed at least", (*marks, *names, *below))


def trials():
    """How far an object moves in the hand over time, in the hardest trial of each kind."""
    body = scenes.example_object("box")
    grasp = gc.plan(body, FRICTION, limit=1).grasps[0]
    runs = [hardest(body, grasp, mass_kg) for mass_kg in MASSES_KG]
    marks = []
    for place, kind in enumerate(TRIAL_KINDS):
        left, top = 30.0 + 300.0 * (place % 3), 30.0 + 205.0 * (place // 3)
        longest = max(float(run[kind][0][-1]) for run in runs)
        panel = Panel(left, top, 250.0, 140.0, Axis(0.0, longest), Axis(0.0, 8.0))
        marks += [
            *panel.frame(panel.x.ticks(4), (0.0, 2.0, 4.0, 6.0, 8.0)),
            panel.level(5.0, BAD_HEX),
        ]
        marks += [
            panel.curve(*run[kind], colour, 1.8)
            for run, colour in zip(runs, FINGER_COLOURS, strict=False)
        ]
        marks.append(Words(left, top - 14.0, f"{kind}: moved [mm]", "start", 13.0, bold=True))
    key = [
        KeyLine(f"{mass_kg:g} kg", colour)
        for mass_kg, colour in zip(MASSES_KG, FINGER_COLOURS, strict=False)
    ]
    marks.append(Words(870.0, 425.0, "time [s]", "end"))
    below, _ = keyed([*key, KeyLine("lost beyond", BAD_HEX, "dashes")], 30.0, 425.0, 700.0)
    return Sheet(900.0, 440.0, "six kinds of trials", (*marks, *below))


def hardest(body, grasp, mass_kg):
    """Simulate an execution: times and displacements [s, mm] of the worst trial of each kind."""
    settings = ExecutionSettings(mass_kg=mass_kg).for_body(body)
    holder = SpringFingers(body, grasp.contacts, FRICTION)
    scene, _, asked, _ = planned(holder, settings, holder.squeeze(settings))
    found = {}
    for trial, motion in run_trials(HeldBench(scene, lost_m=body.radius), asked).items():
        away = motion.shifts[trial.begun :] - motion.shifts[trial.begun]
        moved = 1000.0 * np.linalg.norm(away, axis=1)
        if trial.kind not in found or moved.max() > found[trial.kind][1].max():
            found[trial.kind] = SAMPLE_S * np.arange(len(moved)), moved
    return found


def block(*, notched=False):
    """The mesh of a tapered block [mm]; or with a notch in its upper edge, under a contact."""
    bottom = [(x, y, 0.0) for x in (-30.0, 30.0) for y in (-20.0, 20.0)]
    top = [(x, y, 35.0) for x in (-12.0, 24.0) for y in (-14.0, 14.0)]
    mesh = trimesh.PointCloud(bottom + top).convex_hull
    if not notched:
        return mesh
    cut = trimesh.creation.box(bounds=((-3.0, -20.0, 26.0), (13.0, -8.0, 46.0)))
    return trimesh.boolean.difference([mesh, cut], engine="manifold")


def changed():
    """A block before and after somebody has cut a notch where a finger stood."""
    before, after = (
        gc.Polyhedron.from_mesh(0.001 * mesh.vertices, mesh.faces, name="block")
        for mesh in (block(), block(notched=True))
    )
    plan = gc.plan(before, 0.4, limit=3)
    drawing = Drawing(before, plan["c-0-1-2-3"], 0.4)
    shapes, view = drawing.shapes(), Camera.of_angles(-60.0, 25.0, before)
    sheets = []
    for title, body in (("before", before), ("after: c-0-1-2-3 is gone", after)):
        shown = (*glass(body), *shapes[len(glass(before)) :])
        sheet = sheet_of(shown, before, view, title, numbers=drawing.numbers(), side=PIXELS)
        sheets.append(titled(sheet, title))
    return beside(sheets)


def titled(sheet, title):
    """A sheet with a title above it."""
    marks = [moved(mark, np.array([0.0, TITLE])) for mark in sheet.marks]
    words = Words(0.5 * sheet.width, 14.0, title, "middle", 16.0, bold=True)
    return Sheet(sheet.width, sheet.height + TITLE, title, (*marks, words))


def rows():
    """A grasp and the negative controls that a dataset has beside it, with their contacts."""
    body, grasp = best("wedge", "pencil", FRICTION)
    size, view = finger_size(body), best_view(body, grasp)
    cases = [("grasp", grasp.contacts, FRICTION)]
    for each in negative_controls(body, grasp, FRICTION, seed=0):
        cases.append((each.name, each.contacts, each.friction))
    sheets = []
    for name, contacts, friction in cases:
        shapes = [
            *glass(body),
            Drawable("contact", points=np.array([c.position for c in contacts])),
        ]
        for contact in contacts:
            finger = int(np.linalg.norm(grasp.normals - contact.normal, axis=1).argmin())
            shapes += pin(finger, contact.position, contact.normal, size)
            sides = cone_sides(
                contact.position, contact.normal, math.atan(friction), CONE_LENGTH * size
            )
            shapes.append(Drawable("force cone", finger, polygons=sides))
        sheets.append(titled(sheet_of(shapes, body, view, name, side=320), name))
    return beside(sheets)


def kept_by_distance():
    """Read the table on misplaced objects, cell by cell."""
    lines = [*BENCHMARKS.read_text(encoding="utf-8").splitlines(), ""]
    first = next(place for place, line in enumerate(lines) if "is kept, by distance" in line)
    end = next(place for place in range(first, len(lines)) if not lines[place].startswith("|"))
    return [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines[first:end]]


PICTURES: dict[str, Callable[[], Sheet]] = {
    make.__name__: make
    for make in (
        families, certificate, grasp, hand, regions, wrenches, margins, motion, fidelity, misplaced,
        placement, trials, changed, rows,
    )
}  # fmt: skip


def report() -> bytes:
    """The first page of the report on the part of docs/start.md, as a browser shows it."""
    from sim_validate.main import main as graspproof
    from tests.browser import headless, opened

    with TemporaryDirectory() as folder:
        part = Path(folder) / "part.stl"
        mesh = scenes.example_object("l-bracket").to_trimesh()
        mesh.apply_scale(1000.0)
        mesh.export(part)
        words = ["run", str(part), "--unit", "mm", "--limit", "4", "--out", f"{folder}/out", "-q"]
        assert graspproof(words) == 0
        with headless(f"{folder}/profile") as browser:
            opened(browser, Path(folder) / "out" / "report" / "index.html", width=1000)
            size = {"width": 1000, "height": 1290, "deviceScaleFactor": 1, "mobile": False}
            browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
            return browser.get_screenshot_as_png()


PAGES: dict[str, Callable[[], bytes]] = {"report": report}
"""Pictures of pages, which need a browser."""


def main() -> None:
    for name in sys.argv[1:] or (*PICTURES, *PAGES):
        path = FOLDER / f"{name}.webp"
        png = PAGES[name]() if name in PAGES else png_of(PICTURES[name]())
        with Image.open(io.BytesIO(png)) as picture:
            picture.convert("RGB").save(path, quality=75, method=6)
        print(path)


if __name__ == "__main__":
    main()
