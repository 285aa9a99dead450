"""How large are certified regions, and are all choices of contacts in them closed?

    python -m tests.benchmarks.regions [--grasps 500] [--cones N] [--simulate 25]

Per family, on built-in and random objects: how many grasps got regions, the exact test on random
choices of contacts in them (corners often), and sizes beside the paper's own regions. Of the first
ones, simulation of twenty choices each, and of contacts that walk outwards together, from the
centres through the border until they are not held. An hour for everything, half with
`--cones 1250`; `--grasps 20 --simulate 2` for some minutes.
"""

import argparse
import sys
import time
from dataclasses import dataclass, field, replace

import numpy as np

import grasp_core as gc
import scenes
import sim_validate as sv
from grasp_core.objects.face_pieces import piece_of
from grasp_core.regions.certify_regions import CONES, certify_regions
from grasp_core.values import Contact
from sim_validate.kit.processes import available_cores, each
from sim_validate.planning.regions import area_of
from tests.benchmarks.objects import FAMILIES

FRICTION = 0.5
OBJECTS = (
    "tetrahedron", "octahedron", "dodecahedron", "icosahedron", "wedge", "chamfered-box",
    "hexagonal-pyramid", "box", "prism", "double-wedge-bar", "hex-nut", "l-bracket", "cross",
    "screwdriver", "mug",
)  # fmt: skip
SLACK = 1e-7
WALKS = np.concatenate([[0.95, 1.0], np.arange(1.02, 1.2, 0.02), np.arange(1.2, 4.01, 0.1)])
"""How far contacts walk, relative to the border."""


@dataclass(frozen=True)
class Task:
    name: str
    family: str
    place: int
    seed: int
    choices: int
    simulate: bool
    cones: int


@dataclass(frozen=True)
class Answer:
    family: str
    proved: bool
    verified: bool = True
    opened: int = 0
    tried: int = 0
    dropped: int = 0
    simulated: int = 0
    walks: list = field(default_factory=list)
    """How far contacts walked until they were not closed, and not held, in borders' distances."""
    sizes: dict = field(default_factory=dict)
    """Sizes of the paper's regions and ours: disc, inscribed radius, total area, seconds."""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--grasps", type=int, default=500)
    parser.add_argument("--choices", type=int, default=200)
    parser.add_argument("--simulate", type=int, default=25)
    parser.add_argument("--cones", type=int, default=CONES)
    parser.add_argument("--family", action="append", choices=FAMILIES)
    asked = parser.parse_args()
    tasks = list(tasks_of(asked))
    answers, begun = [], time.perf_counter()
    for answer in each(examine, tasks, jobs=available_cores()):
        answers.append(answer)
        if len(answers) % 50 == 0:
            print(
                f"{len(answers)} of {len(tasks)}, {time.perf_counter() - begun:.0f} s", flush=True
            )
    wrong = 0
    for family in asked.family or FAMILIES:
        wrong += show(family, [answer for answer in answers if answer.family == family])
    return int(wrong > 0)


def tasks_of(asked):
    """Grasps of each family, the first of each object in turn, then the second, and so on."""
    for family in asked.family or FAMILIES:
        counts = {}
        names = [*OBJECTS, *(f"random-{n}-{s}" for n in (8, 10, 12, 14) for s in range(20))]
        limit = -(-asked.grasps // len(OBJECTS))
        for name in names:
            body = scenes.example_object(name)
            counts[name] = len(gc.plan(body, FRICTION, families=(family,), limit=limit).grasps)
            if sum(counts.values()) >= asked.grasps:
                break
        chosen = sorted((place, name) for name, n in counts.items() for place in range(n))
        for number, (place, name) in enumerate(chosen[: asked.grasps]):
            yield Task(name, family, place, number, asked.choices, number < asked.simulate,
                       asked.cones), limit  # fmt: skip


def examine(given):
    task, limit = given
    body = scenes.example_object(task.name)
    grasp = gc.plan(body, FRICTION, families=(task.family,), limit=limit).grasps[task.place]
    sizes = {"paper": (grasp.radius / body.radius, grasp.radius / body.radius,
                       sum(map(area_of, grasp.regions)) / body.radius**2, 0.0)}  # fmt: skip
    begun = time.perf_counter()
    proved = certify_regions(body, grasp, FRICTION, max_cones=task.cones)
    if proved is None:
        return Answer(task.family, proved=False, sizes=sizes)
    sizes["discs"] = (*size(proved, body), time.perf_counter() - begun)
    rng = np.random.default_rng(task.seed)
    opened = sum(not gc.force_closure(drawn(proved, rng), grasp.normals, FRICTION).closed
                 for _ in range(task.choices))  # fmt: skip
    held = [holds(body, grasp, drawn(proved, rng)) for _ in range(20 if task.simulate else 0)]
    return Answer(
        task.family, True, proved.verify(), opened, task.choices,
        sum(each is False for each in held), sum(each is not None for each in held),
        walks(body, grasp, proved, rng) if task.simulate else [], sizes,
    )  # fmt: skip


def size(proved, body):
    inscribed = min(region.inscribed_radius for region in proved.regions)
    area = sum(map(area_of, proved.regions))
    return proved.radius / body.radius, inscribed / body.radius, area / body.radius**2


def drawn(proved, rng):
    """Contacts in the regions, corners often."""
    return np.array([
        rng.dirichlet(np.full(len(region.polygon), rng.choice([0.02, 0.3, 1.0]))) @ region.polygon
        for region in proved.regions
    ])  # fmt: skip


def holds(body, grasp, positions):
    """Whether contacts hold all wrenches in simulation; None if fingertips find no room."""
    contacts = tuple(map(Contact, positions, grasp.normals))
    moved = replace(grasp, contacts=contacts)
    agenda = sv.Agenda(controls=False, critical_friction=False)
    verdict = sv.validate(body, moved, FRICTION, agenda=agenda)
    return None if verdict.outcome is sv.Outcome.INVALID_START else verdict.held


def walks(body, grasp, proved, rng):
    """How far contacts walk, to random corners and to an open choice, by kind."""
    found = []
    for _ in range(3):
        corners = np.array([
            region.polygon[rng.integers(len(region.polygon))] for region in proved.regions
        ])  # fmt: skip
        middles = np.array([region.polygon.mean(axis=0) for region in proved.regions])
        found.append(("random", *walked(body, grasp, middles, corners)))
    if proved.open_choice is not None:
        share = proved.radius / proved.limit
        borders = proved.centers + share * (proved.open_choice - proved.centers)
        found.append(("adverse", *walked(body, grasp, proved.centers, borders)))
    return found


def walked(body, grasp, middles, borders):
    """How far contacts walk from their middles, the borders at one, till not closed and not held.

    Infinite where a contact leaves its face before that.
    """
    pieces = unit_pieces(body, grasp)
    opened = dropped = float("inf")
    for far in WALKS:
        positions = middles + far * (borders - middles)
        at = (positions - body.center_of_mass) / body.radius
        outside = [(p.E @ p.frame.T @ (x - p.origin) - p.b).max()
                   for p, x in zip(pieces, at, strict=True)]  # fmt: skip
        if max(outside) > SLACK:
            break
        closed = gc.force_closure(positions, grasp.normals, FRICTION).closed
        if not closed:
            opened = min(opened, far)
        if (not closed or far <= 1.0) and holds_or_not(body, grasp, positions) is False:
            dropped = far
            break
    return opened, dropped


def holds_or_not(body, grasp, positions):
    """As `holds`; None also where there is no closure, so that no wrenches can be chosen."""
    try:
        return holds(body, grasp, positions)
    except gc.GraspError:
        return False


def show(family, answers):
    """A family's figures; how much was wrong."""
    done = [answer for answer in answers if answer.proved]
    opened, dropped = sum(a.opened for a in done), sum(a.dropped for a in done)
    unverified = sum(not a.verified for a in done)
    print(
        f"{family}: {len(done)} of {len(answers)} got regions; {opened} of "
        f"{sum(a.tried for a in done)} choices open, {dropped} of {sum(a.simulated for a in done)} "
        f"dropped in simulation, {unverified} proofs not verified"
    )
    early = 0
    for kind in ("random", "adverse"):
        far = np.array([walk[1:] for a in done for walk in a.walks if walk[0] == kind])
        if len(far):
            ended = far[np.isfinite(far[:, 1])]
            too_early = int((far[:, 1] < far[:, 0]).sum() + (far.min(axis=1) <= 1.0).sum())
            early += too_early
            print(f"  {len(far)} {kind} walks, {len(ended)} end on the faces: {told(ended[:, 0])} "
                  f"not closed, {told(ended[:, 1])} not held; {too_early} too early")  # fmt: skip
    table(done)
    return opened + dropped + unverified + early


def told(far):
    """Distances in those of the borders."""
    if not len(far):
        return "-"
    return f"from {far.min():.2f} (median {np.median(far):.2f})"


def table(done):
    """Medians of sizes."""
    print("  medians in object radii: disc, least inscribed, total area, seconds")
    for way in ("paper", "discs"):
        rows = [answer.sizes[way] for answer in done]
        figures = "  ".join(f"{figure:8.4f}" for figure in np.median(rows, axis=0))
        print(f"    {way:<11} {figures}")


def unit_pieces(body, grasp):
    """The convex pieces that contacts are on, at unit size."""
    found = []
    for index, point in zip(grasp.faces, grasp.positions, strict=True):
        face = body.faces[index]
        pieces = [piece_of(index, face.normal, (corners - body.center_of_mass) / body.radius)
                  for corners in face.pieces]  # fmt: skip
        at = (point - body.center_of_mass) / body.radius
        found.append(
            max(pieces, key=lambda p, at=at: (p.b - p.E @ p.frame.T @ (at - p.origin)).min())
        )
    return found


if __name__ == "__main__":
    sys.exit(main())
