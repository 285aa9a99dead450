"""The pictures of the README and of docs/: `python -m tests.docs_pictures` makes them again.

Names of pictures after the command choose some of them.
"""

import math
import sys
from collections.abc import Callable
from pathlib import Path

import grasp_core as gc
import scenes
from scenes.drawing.canvas import Around, entitle, figure_with_panels, in_style, write_figure
from scenes.drawing.flat.colours import FINGERS
from scenes.drawing.pictures import draw_grasp, grasp_figure
from scenes.drawing.views import best_view
from sim_validate.execution.jobs import ExecutionJob, executed_grasp
from sim_validate.execution.settings import ExecutionSettings
from sim_validate.records.executions_json import Executions
from sim_validate.replaying.recorded import Recorded
from sim_validate.replaying.replay import replayed
from sim_validate.reports.drawn_grasps import certified
from sim_validate.reports.fidelity_charts import Agreement, fidelity_figure
from sim_validate.reports.margin_charts import margin_figure
from sim_validate.reports.motion_charts import motion_figure
from sim_validate.reports.survival_charts import survival_figure
from sim_validate.reports.wrench_charts import wrench_figure
from sim_validate.simulation.setup import Agenda, Setup

FOLDER = Path(__file__).parent.parent / "docs" / "pictures"
BENCHMARKS = FOLDER.parent / "benchmarks.md"
AXES = Around(left=0.11, right=0.03, below=0.16, above=0.05, between=0.0)
TEN_DEGREES = math.tan(math.radians(10.0))
FAMILIES = (
    ("dodecahedron", "concurrent", TEN_DEGREES, "normal"),
    ("double-wedge-bar", "pencil", TEN_DEGREES, "normal"),
    ("icosahedron", "regulus", 0.3, "tilted"),
)
FRICTION = 0.5


def best(name, family, friction, cones="tilted"):
    body = scenes.example_object(name)
    plan = gc.plan(body, friction, families=(family,), cones=cones, limit=1)
    return body, plan.grasps[0]


@in_style
def families():
    """A grasp of each of the paper's families, side by side."""
    around = Around(left=0.0, right=0.0, below=0.0, above=0.07, between=0.02)
    figure, places = figure_with_panels(12.0, 4.3, 3, around=around)
    for axes, case in zip(places, FAMILIES, strict=True):
        body, grasp = best(*case)
        draw_grasp(axes, body, grasp, case[2], best_view(body, grasp))
        entitle(axes, case[1])
    return figure


def grasp():
    """One grasp, with all that its picture explains."""
    return grasp_figure(*best("wedge", "pencil", FRICTION), FRICTION)


def regions():
    """Certified regions of a regulus, for which the paper has none."""
    body, grasp = best("octahedron", "regulus", FRICTION)
    found = gc.certify_regions(body, grasp, FRICTION, max_cones=1250)
    record = {"regions": [{"polygon_m": region.polygon,
                           "inscribed_radius_m": region.inscribed_radius}
                          for region in found.regions]}  # fmt: skip
    return grasp_figure(body, certified(grasp, record), FRICTION)


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
    return motion_figure(found, threshold)


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
    return fidelity_figure([Agreement("critical friction", tuple(pairs))])


def survival():
    """Survival of executed grasps of a wedge of 0.7 kg, by the acceleration of the palm."""
    body = scenes.example_object("wedge")
    settings = ExecutionSettings(0.7)
    found = [
        executed_grasp(ExecutionJob(body, grasp, FRICTION, settings))
        for grasp in gc.plan(body, FRICTION, limit=8).grasps
    ]
    return survival_figure(
        [Executions(body.content_sha256, FRICTION, settings, True, tuple(found))]
    )


@in_style
def misplaced():
    """Share of misplaced objects that are kept, from the table of the benchmarks' page."""
    header, _, *rows = kept_by_distance()
    distances = [float(cell) for cell in header[1:]]
    figure, (axes,) = figure_with_panels(6.4, 3.6, 1, around=AXES)
    for colour, (family, *cells) in zip(FINGERS, rows, strict=True):
        counts = [[int(part) for part in cell.split(" of ")] for cell in cells]
        shares = [kept / count for kept, count in counts]
        axes.plot(distances, shares, "o-", color=colour, label=family)
    axes.set(xlabel="distance from the expected place [mm]", ylabel="share kept", ylim=(0.0, 1.02))
    axes.set_xticks(distances)
    axes.legend(loc="lower left", frameon=False)
    return figure


def kept_by_distance():
    """Read the table on misplaced objects, cell by cell."""
    lines = [*BENCHMARKS.read_text(encoding="utf-8").splitlines(), ""]
    first = next(place for place, line in enumerate(lines) if line.startswith("| kept, by mm"))
    end = next(place for place in range(first, len(lines)) if not lines[place].startswith("|"))
    return [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines[first:end]]


PICTURES: dict[str, Callable[[], object]] = {
    make.__name__: make
    for make in (families, grasp, regions, wrenches, margins, motion, fidelity, survival, misplaced)
}


def main() -> None:
    for name in sys.argv[1:] or PICTURES:
        print(write_figure(PICTURES[name](), FOLDER / f"{name}.webp"))


if __name__ == "__main__":
    main()
