"""How large are certified regions, and are all choices of contacts in them closed?

    python -m tests.benchmarks.regions [--grasps 500] [--choices 200] [--simulate 100] [--cones N]

Per family, on built-in and random objects: how many grasps got regions, the exact test on random
choices of contacts in them (corners often), simulation of some with controls of none, and sizes
beside the paper's own regions and beside the largest disc for which no choice was found open by
descent. Some hours for everything; `--grasps 20 --simulate 5` for some minutes.
"""

import argparse
import sys
import time
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

import grasp_core as gc
import scenes
import sim_validate as sv
from grasp_core.certified_regions import certify_regions
from grasp_core.values import Contact
from grasp_core.wrenches import contact_frames
from sim_validate.engines import available_cores, each
from sim_validate.regions_command import area_of

FRICTION = 0.5
OBJECTS = (
    "tetrahedron", "octahedron", "dodecahedron", "icosahedron", "wedge", "chamfered-box",
    "hexagonal-pyramid", "box", "prism", "double-wedge-bar", "hex-nut", "l-bracket", "cross",
    "screwdriver", "mug",
)  # fmt: skip
FAMILIES = ("concurrent", "pencil", "regulus", "free")
STARTS, FINE = 6, 0.02


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
    seconds: float = 0.0
    radius: float = 0.0
    inscribed: float = 0.0
    area: float = 0.0
    planned: float = 0.0
    planned_area: float = 0.0
    possible: float = 0.0


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--grasps", type=int, default=500)
    parser.add_argument("--choices", type=int, default=200)
    parser.add_argument("--simulate", type=int, default=100)
    parser.add_argument("--cones", type=int, default=200_000)
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
    for family in FAMILIES:
        wrong += show(family, [answer for answer in answers if answer.family == family])
    return int(wrong > 0)


def tasks_of(asked):
    """Grasps of each family, the first of each object in turn, then the second, and so on."""
    for family in FAMILIES:
        counts = {}
        names = [*OBJECTS, *(f"random-{n}-{s}" for n in (8, 10, 12, 14) for s in range(20))]
        for name in names:
            body = scenes.example_object(name)
            limit = -(-asked.grasps // len(OBJECTS))
            counts[name] = len(gc.plan(body, FRICTION, families=(family,), limit=limit).grasps)
            if sum(counts.values()) >= asked.grasps:
                break
        chosen = sorted((place, name) for name, n in counts.items() for place in range(n))
        for number, (place, name) in enumerate(chosen[: asked.grasps]):
            limit = counts[name]
            yield (Task(name, family, place, number, asked.choices, number < asked.simulate,
                        asked.cones), limit)  # fmt: skip


def examine(given):
    task, limit = given
    body = scenes.example_object(task.name)
    grasp = gc.plan(body, FRICTION, families=(task.family,), limit=limit).grasps[task.place]
    begun = time.perf_counter()
    proved = certify_regions(body, grasp, FRICTION, cones=task.cones)
    seconds = time.perf_counter() - begun
    if proved is None:
        return Answer(task.family, proved=False, seconds=seconds)
    rng = np.random.default_rng(task.seed)
    opened = sum(not gc.force_closure(drawn(proved, rng), grasp.normals, FRICTION).closed
                 for _ in range(task.choices))  # fmt: skip
    dropped = simulated = 0
    for _ in range(20 if task.simulate else 0):
        held = holds(body, grasp, drawn(proved, rng))
        simulated += held is not None
        dropped += held is False
    size = body.radius
    return Answer(
        task.family, True, proved.verify(), opened, task.choices, dropped, simulated, seconds,
        proved.radius / size, min(r.inscribed_radius for r in proved.regions) / size,
        sum(map(area_of, proved.regions)) / size**2, grasp.radius / size,
        sum(map(area_of, grasp.regions)) / size**2, possible(grasp, rng) / size,
    )  # fmt: skip


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


def possible(grasp, rng):
    """A radius of discs for which a choice that is open was found by descent, just about."""
    frames = contact_frames(grasp.normals)

    def margin(angles, radius):
        ways = np.cos(angles)[:, None] * frames[:, :, 1] + np.sin(angles)[:, None] * frames[:, :, 2]
        try:
            return gc.force_closure(grasp.positions + radius * ways, grasp.normals, FRICTION).margin
        except gc.UndecidedError:
            return 0.0

    def opens(radius):
        return any(
            minimize(margin, rng.uniform(0.0, 2.0 * np.pi, 4), (radius,), "Nelder-Mead",
                     options={"maxiter": 200, "xatol": 1e-3, "fatol": 1e-9}).fun <= 0.0
            for _ in range(STARTS)
        )  # fmt: skip

    lower, upper = 0.0, 0.1 * np.linalg.norm(np.ptp(grasp.positions, axis=0))
    while not opens(upper):
        lower, upper = upper, 1.6 * upper
    while upper - lower > FINE * upper:
        middle = 0.5 * (lower + upper)
        lower, upper = (lower, middle) if opens(middle) else (middle, upper)
    return upper


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
    if done:
        shares = [answer.radius / answer.possible for answer in done]
        print(
            f"  in object radii, medians: disc proved {median(done, 'radius'):.4f}, inscribed "
            f"{median(done, 'inscribed'):.4f}, paper's {median(done, 'planned'):.4f}, descent "
            f"{median(done, 'possible'):.4f}; proved of it: median {np.median(shares):.2f}, least "
            f"{min(shares):.2f}; area {median(done, 'area'):.3f}, paper's "
            f"{median(done, 'planned_area'):.3f}; {median(done, 'seconds'):.2f} s each"
        )
    return opened + dropped + unverified


def median(answers, name):
    return float(np.median([getattr(answer, name) for answer in answers]))


if __name__ == "__main__":
    sys.exit(main())
