"""Whether anything exceeds the bound on the best grasp: `python -m tests.benchmarks.best_bounds`.

For each object and friction a bound is proved once. Then contacts are looked for that exceed it:
random ones (anywhere clear of edges, near corners, and near the best grasp), random ones in force
closure that climb to a local optimum, planned grasps that are optimised, an independent global
search (scipy's differential evolution), and all sets of four points of a grid. The quality of
contacts is measured by the definition: in many twists from above, and where these allow more than a
bound, by `ferrari_canny`. Proofs are also spoiled at random while they claim less than a known
grasp attains: none of them may be accepted. Ends with an error if something exceeds a bound, or a
spoiled proof is accepted.

    python -m tests.benchmarks.best_bounds [OBJECT ...] [--friction MU ...] [--gap 0.15]
        [--random 1000000] [--climbs 10000] [--optimized 300] [--evolutions 20]
        [--tampered 5000] [--grid 4]
"""

import argparse
import itertools
from dataclasses import replace

import numpy as np
from scipy.optimize import differential_evolution

import grasp_core as gc
from grasp_core.optimizing.best.incumbents import climbed
from grasp_core.optimizing.best.search import Searching, Stop
from scenes.example_objects import example_object
from tests.benchmarks.best_grasps import clear
from tests.grasp_core.optimizing.best.supports_of_contacts import supports

OBJECTS = ("tetrahedron", "box", "prism", "octahedron", "wedge")
GRIDDED = ("tetrahedron", "box")
FRICTIONS = (0.3, 0.5, 0.8)
TWISTS, CHUNK = 600, 20_000
NEAR = 0.05
"""Size of the shifts of contacts near the best grasp, in object radii."""
LOWER = 0.98
"""Share of a quality that is attained at which a spoiled proof claims its bound."""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("objects", nargs="*", default=OBJECTS)
    parser.add_argument("--friction", nargs="+", type=float, default=FRICTIONS)
    parser.add_argument("--gap", type=float, default=0.15)
    parser.add_argument("--random", type=int, default=1_000_000)
    parser.add_argument("--climbs", type=int, default=10_000)
    parser.add_argument("--optimized", type=int, default=300)
    parser.add_argument("--evolutions", type=int, default=20)
    parser.add_argument("--tampered", type=int, default=5_000)
    parser.add_argument("--grid", type=int, default=4)
    options = parser.parse_args()
    cases = list(itertools.product(options.objects, options.friction))
    each = {
        name: share(getattr(options, name), len(cases))
        for name in ("random", "climbs", "optimized", "evolutions", "tampered")
    }
    totals = dict.fromkeys(("measured", "grid", *each), 0)
    print(
        "object friction | best bound gap % | nearest to the bound: "
        "random climbed optimised evolved grid"
    )
    for number, (name, friction) in enumerate(cases):
        body = example_object(name)
        found = gc.best_grasp(body, friction, gap=options.gap, time_limit_s=60.0)
        assert found.verify()
        rng = np.random.default_rng([number, 7])
        told = [
            random_ones(body, found, each["random"][number], rng, totals),
            climbed_ones(found, each["climbs"][number], rng, totals),
            optimized_ones(body, found, each["optimized"][number], totals),
            evolved_ones(found, each["evolutions"][number], rng, totals),
            gridded(found, options.grid, totals) if name in GRIDDED else None,
        ]
        tampered_ones(body, found, each["tampered"][number], rng, totals)
        shares = " ".join("-" if one is None else f"{one / found.bound:.4f}" for one in told)
        assert all(one is None or one <= found.bound for one in told)
        print(
            f"{name} {friction:g} | {found.quality.lower:.4f} {found.bound:.4f} "
            f"{100 * found.gap:.1f} | {shares}", flush=True,
        )  # fmt: skip
    print(", ".join(f"{name} {count}" for name, count in totals.items()))
    print("above a bound: 0; spoiled proofs accepted: 0")


def share(total, count):
    """Divide a number into whole parts."""
    return [total // count + (number < total % count) for number in range(count)]


def twists_for(found, rng, count=TWISTS):
    """Unit twists at random, and as many of the proof's."""
    own = found.proof.twists[rng.permutation(len(found.proof.twists))[:count]]
    drawn = np.vstack([rng.normal(size=(count, 6)), own])
    return drawn / np.linalg.norm(drawn, axis=1)[:, None]


def quality(found, on, at):
    """The quality of contacts, with proved ends, at unit size."""
    grounds = found.proof.grounds
    x = np.array([grounds.places(p, y[None])[0] for p, y in zip(on, at, strict=True)])
    return gc.ferrari_canny(
        x, grounds.normals[on], found.proof.friction, torque_scale=1.0, gap=0.01
    )


def random_ones(body, found, count, rng, totals):
    """The largest quality of random contacts whose supports would allow the best's."""
    grounds, twists, nearest = found.proof.grounds, twists_for(found, rng), 0.0
    polygons = grounds.polygons()
    best_on, best_at = of_grasp(body, found)
    left = count
    while left > 0:
        size = min(CHUNK, left)
        left -= size
        on = rng.integers(len(polygons), size=(size, 4))
        near = rng.random(size) < 1.0 / 3.0
        on[near] = best_on
        at = np.empty((size, 4, 2))
        for p, polygon in enumerate(polygons):
            here = on == p
            sharp = rng.choice([0.05, 1.0], size=here.sum())
            weights = rng.gamma(sharp[:, None], size=(here.sum(), len(polygon))) + 1e-300
            at[here] = (weights / weights.sum(axis=1, keepdims=True)) @ polygon
        close = best_at + rng.normal(size=(near.sum(), 4, 2)) * NEAR * rng.random(
            (near.sum(), 1, 1)
        )
        inside = np.array([[within(polygons[p], y) for p, y in zip(best_on, row, strict=True)]
                           for row in close]).all(axis=1)  # fmt: skip
        at[np.flatnonzero(near)[inside]] = close[inside]
        on[np.flatnonzero(near)[~inside]] = best_on
        upper = np.full(size, np.inf)
        for part in np.array_split(twists, 12):
            alive = np.flatnonzero(upper > nearest)
            upper[alive] = np.minimum(
                upper[alive], supports(found, on[alive], at[alive], part).max(axis=1).min(axis=1)
            )
        for row in np.argsort(-upper)[:20]:
            if upper[row] <= nearest:
                break
            nearest = max(nearest, quality(found, on[row], at[row]).lower)
            totals["measured"] += 1
        over = np.flatnonzero(upper > found.bound)
        for row in over:
            assert quality(found, on[row], at[row]).lower <= found.bound
            totals["measured"] += 1
        totals["random"] += size
    return nearest if count else None


def within(polygon, at):
    along = np.roll(polygon, -1, axis=0) - polygon
    side = along[:, 0] * (at[1] - polygon[:, 1]) - along[:, 1] * (at[0] - polygon[:, 0])
    return (side >= 0.0).all() or (side <= 0.0).all()


def of_grasp(body, found):
    """Polygons (4,) and plane coordinates (4, 2) of the best grasp."""
    grounds, on, at = found.proof.grounds, [], []
    for face, point in zip(found.grasp.faces, found.grasp.positions, strict=True):
        unit = (point - body.center_of_mass) / body.radius
        own = [p for p in range(len(grounds.counts)) if grounds.faces[p] == face]
        flat = {p: (unit - grounds.origins[p]) @ grounds.frames[p] for p in own}
        polygons = grounds.polygons()
        chosen = next((p for p in own if within(polygons[p], flat[p])), own[0])
        on.append(chosen)
        at.append(flat[chosen])
    return np.array(on), np.array(at)


def climbed_ones(found, count, rng, totals):
    """The largest quality of random contacts in force closure that climb to a local optimum."""
    grounds, friction = found.proof.grounds, found.proof.friction
    polygons, twists, nearest, left = grounds.polygons(), twists_for(found, rng, 100), 0.0, count
    hunt, equally = Searching(grounds, friction, 1, Stop()), np.arange(len(polygons) + 1)
    while left > 0:
        on, at = placed(rng.random((1000, 12)), polygons, equally / len(polygons))
        upper = supports(found, on, at, twists).max(axis=1).min(axis=1)
        for row in np.flatnonzero(upper > 0.0)[:left]:
            end = climbed(hunt, on[row], np.round(at[row], 6)).quality.lower
            if end > 0.0:
                nearest, left = max(nearest, end), left - 1
                totals["climbs"] += 1
    return nearest if count else None


def optimized_ones(body, found, count, totals):
    """The largest quality of planned grasps, optimised where the search looks for contacts."""
    nearest, grasps = 0.0, gc.plan(body, found.proof.friction).grasps
    for grasp in grasps[:count]:
        moved = gc.optimize_contacts(
            body, grasp, found.proof.friction, finger_radius=found.clearance
        )
        if clear(body, found, moved.grasp):
            nearest = max(nearest, moved.after.lower)
            totals["optimized"] += 1
    return nearest if count else None


def evolved_ones(found, count, rng, totals):
    """The largest quality that differential evolution finds, with worst twists added by and by."""
    nearest, polygons = 0.0, found.proof.grounds.polygons()
    areas = np.array([area(polygon) for polygon in polygons])
    edges = np.concatenate([[0.0], np.cumsum(areas / areas.sum())])
    for _ in range(count):
        twists = twists_for(found, rng, 150)

        def upper(genes, twists=twists):
            on, at = placed(genes.T, polygons, edges)
            return -supports(found, on, at, twists).max(axis=1).min(axis=1)

        ended = differential_evolution(
            upper, [(0.0, 1.0)] * 12, rng=rng, maxiter=250, popsize=10, tol=1e-6, polish=False,
            vectorized=True, updating="deferred",
        )  # fmt: skip
        on, at = placed(ended.population, polygons, edges)
        for row in np.argsort(ended.population_energies)[:10]:
            nearest = max(nearest, quality(found, on[row], at[row]).lower)
        totals["evolutions"] += 1
    return nearest if count else None


def area(polygon):
    x, y = polygon.T
    return 0.5 * abs(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def placed(genes, polygons, edges):
    """Polygons and plane coordinates of contacts from numbers between 0 and 1, (n, 12)."""
    genes = genes.reshape(len(genes), 4, 3)
    on = np.clip(np.searchsorted(edges, genes[..., 0], side="right") - 1, 0, len(polygons) - 1)
    at = np.empty((*on.shape, 2))
    for p, polygon in enumerate(polygons):
        here = on == p
        a, b = genes[here, 1], genes[here, 2]
        # along the border, and from the middle outwards
        place = a * len(polygon)
        first = np.minimum(place.astype(int), len(polygon) - 1)
        side = (place - first)[:, None]
        rim = (1.0 - side) * polygon[first] + side * polygon[(first + 1) % len(polygon)]
        at[here] = polygon.mean(axis=0) + np.sqrt(b)[:, None] * (rim - polygon.mean(axis=0))
    return on, at


def grid_points(polygons, steps):
    """Points of a grid on each triangle of a polygon's fan, with the polygon's number."""
    triangles = [(p, k) for p, polygon in enumerate(polygons) for k in range(1, len(polygon) - 1)]
    weights = [(steps - i - j, j, i) for i in range(steps + 1) for j in range(steps + 1 - i)]
    found = [
        (p, np.array(w) / steps @ polygons[p][[0, k, k + 1]])
        for p, k in triangles
        for w in weights
        if k == 1 or w[1] > 0
    ]
    return np.array([p for p, _ in found]), np.array([at for _, at in found])


def gridded(found, steps, totals):
    """The largest quality of all sets of four points of a grid on all faces."""
    on, at = grid_points(found.proof.grounds.polygons(), steps)
    twists = twists_for(found, np.random.default_rng(0))
    each = supports(found, on[:, None], at[:, None], twists)[:, 0]
    sets = np.array(list(itertools.combinations(range(len(on)), 4)), dtype=np.int32)
    totals["grid"] += len(sets)
    nearest = 0.0
    uppers = np.empty(len(sets))
    for part in np.array_split(np.arange(len(sets)), max(1, len(sets) // CHUNK)):
        best = np.full(len(part), np.inf)
        for columns in np.array_split(np.arange(len(twists)), 24):
            alive = np.flatnonzero(best > 0.5 * found.quality.lower)
            chosen = each[:, columns][sets[part[alive]]]
            best[alive] = np.minimum(best[alive], chosen.max(axis=1).min(axis=1))
        uppers[part] = best
    for row in np.argsort(-uppers):
        if uppers[row] <= nearest:
            break
        nearest = max(nearest, quality(found, on[sets[row]], at[sets[row]]).lower)
        totals["measured"] += 1
    return nearest


def tampered_ones(body, found, count, rng, totals):
    """Spoil a proof that claims too little; it must be refused each time."""
    proof, attained = found.proof, found.quality.lower
    false = replace(proof, threshold=LOWER * attained)
    assert not false.verify()
    for number in range(count):
        spoiled = SPOILED[number % len(SPOILED)](false, rng)
        assert not spoiled.verify(), f"{body.name}: a spoiled proof is accepted"
        totals["tampered"] += 1


def other_twist(proof, rng):
    twists = proof.twists.copy()
    row = rng.integers(len(twists))
    twists[row] += 10.0 ** rng.uniform(-6, 0) * rng.normal(size=6)
    twists[row] /= np.linalg.norm(twists[row])
    return replace(proof, twists=twists)


def other_deed(proof, rng):
    deeds = proof.deeds.copy()
    row = rng.integers(len(deeds))
    deeds[row] = rng.choice([0, int(rng.integers(16)), 16 + int(rng.integers(4))])
    return replace(proof, deeds=deeds)


def other_question(proof, rng):
    asked = proof.asked.copy()
    rows = rng.integers(len(asked), size=1 + rng.integers(5))
    asked[rows] = rng.integers(len(proof.twists), size=len(rows))
    return replace(proof, asked=asked)


def all_refuted(proof, rng):
    """Every case is said to be refuted by some twist, and nothing follows."""
    count = int(rng.integers(1, 1 + min(50, len(proof.deeds))))
    return replace(
        proof, deeds=np.zeros(count, np.int64), asked=rng.integers(len(proof.twists), size=count)
    )


def cut_short(proof, rng):
    count = int(rng.integers(len(proof.deeds)))
    return replace(proof, deeds=proof.deeds[:count], asked=proof.asked[:count])


def long_twist(proof, rng):
    return replace(proof, twists=proof.twists * rng.uniform(0.1, 1.9))


SPOILED = (other_twist, other_deed, other_question, all_refuted, cut_short, long_twist)


if __name__ == "__main__":
    main()
