"""What a small network learns from a dataset: survival of grasps on objects it has not seen.

    python -m tests.benchmarks.learning FOLDER --make 178 --meshes SCANS     (meshes, settings)
    graspproof dataset build FOLDER/learning.toml --out DS
    python -m tests.benchmarks.learning DS

Objects are divided into five parts, and each part is predicted by networks that were trained on the
others. Printed is the area under the curve of each score, over the rows whose survival is known:
Ferrari-Canny's quality, the same over the weight, a network that was trained with survival, and one
that was trained with the synthetic negative controls only, as they were all that datasets had.
"""

import argparse
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np

import grasp_core as gc
import sim_validate
from grasp_core.execution.loads import GRAVITY_M_PER_S2
from tests.benchmarks.made_objects import write_objects

FOLDS = 5
HIDDEN = 16
STEPS = 600
RATE = 3e-3
DECAY = 0.1
NETWORKS = 5
"""Number of networks, each started elsewhere, whose predictions are averaged."""
HARD = ("planned", "moved_out", "mass_near")
LEAST = 1e-3
"""Quality below which grasps are not told apart [N]."""
SETTINGS = """\
objects = [{objects}]
frictions = [0.3, 0.5]
families = ["free"]
limit = 1
[execution]
mass_kg = 0.5
trials = ["weight", "knock"]
knock_n_s = 0.05
[learning]
friction_near = 1
friction_above = 1
moved_out = 2
mass_near = 1
figures = ["closure"]
"""


@dataclass(frozen=True, eq=False)
class Rows:
    """Rows of four contacts as a network sees them."""

    inputs: np.ndarray
    """Numbers that no rigid motion and no scale of the object changes, (n, d)."""
    survived: np.ndarray
    """1, 0, or NaN where it is not known, (n,)."""
    controls: np.ndarray
    """Whether a row is a synthetic negative control, (n,)."""
    planned: np.ndarray
    quality: np.ndarray
    """Ferrari-Canny's quality; 0 where contacts are not in force closure, (n,) [N]."""
    hard: np.ndarray
    """Whether a row is of a kind that the friction alone does not decide, (n,)."""
    weight: np.ndarray
    objects: np.ndarray
    """Number of the object, (n,)."""


def rows_of(folder: Path) -> Rows:
    """Read a dataset with executions and figures of closure."""
    tables = sim_validate.load_dataset(folder)
    grasps, objects = tables["grasps"], tables["objects"]
    whole = grasps["contacts"] == 4
    grasps = {name: values[whole] for name, values in grasps.items()}
    names = list(objects["object_id"])
    number = np.array([names.index(each) for each in grasps["object_id"]])
    radius, center = objects["radius_m"][number], objects["center_of_mass_m"][number]
    usual = np.nanmedian(grasps["mass_kg"])
    # a mass is not known where no squeeze was found: then it is that of the settings
    weight = np.where(np.isnan(grasps["mass_kg"]), usual, grasps["mass_kg"]) * GRAVITY_M_PER_S2
    points = (grasps["contact_points_m"] - center[:, None]) / radius[:, None, None]
    shape = invariants(points, grasps["contact_normals"])
    places = zip(points, grasps["contact_normals"], grasps["friction"], strict=True)
    metrics = [
        (gc.min_weight(*each), gc.hull_volume(*each, center=np.zeros(3), torque_scale=1.0))
        for each in places
    ]
    known = [grasps["closure_margin"], grasps["smallest_singular_value"]]
    figures = np.nan_to_num(np.column_stack([*known, np.array(metrics)]), neginf=0.0)
    quality = np.nan_to_num(grasps["ferrari_canny_lower_n"])
    logarithms = np.log(np.column_stack([grasps["friction"], weight, radius, quality + LEAST]))
    inputs = np.column_stack([shape, figures, logarithms, quality / weight])
    return Rows(
        inputs=inputs,
        survived=np.asarray(grasps["survived"], dtype=float),
        controls=np.array([each is not None for each in grasps["control_of"]]),
        planned=grasps["kind"] == "planned",
        quality=quality,
        hard=np.isin(grasps["kind"], HARD),
        weight=weight,
        objects=number,
    )


def invariants(points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return sorted distances, angles and levers of four contacts, which no motion changes."""
    pairs = np.array(list(combinations(range(4), 2)))
    apart = points[:, pairs[:, 1]] - points[:, pairs[:, 0]]
    sizes = np.linalg.norm(apart, axis=2)
    angles = np.einsum("npi,npi->np", normals[:, pairs[:, 0]], normals[:, pairs[:, 1]])
    along = apart / np.maximum(sizes, 1e-9)[..., None]
    facing = np.concatenate(
        [np.einsum("npi,npi->np", normals[:, pairs[:, 0]], along),
         -np.einsum("npi,npi->np", normals[:, pairs[:, 1]], along)], axis=1,
    )  # fmt: skip
    levers = np.linalg.norm(np.cross(points, normals), axis=2)
    middle = np.linalg.norm(points.mean(axis=1), axis=1, keepdims=True)
    return np.concatenate([np.sort(each, axis=1) for each in (sizes, angles, facing, levers)]
                          + [middle], axis=1)  # fmt: skip


def area_under_curve(scores: np.ndarray, labels: np.ndarray) -> float:
    """Return the share of pairs of a survivor and a loser that the scores put in order."""
    winners, losers = scores[labels == 1.0], scores[labels == 0.0]
    above = (winners[:, None] > losers[None]).mean()
    return float(above + 0.5 * (winners[:, None] == losers[None]).mean())


def trained(inputs: np.ndarray, labels: np.ndarray, seed: int) -> list[np.ndarray]:
    """Train a network of one hidden layer by Adam, with both labels weighing the same."""
    rng = np.random.default_rng(seed)
    weights = [
        rng.normal(size=(inputs.shape[1], HIDDEN)) / np.sqrt(inputs.shape[1]), np.zeros(HIDDEN),
        rng.normal(size=HIDDEN) / np.sqrt(HIDDEN), np.zeros(()),
    ]  # fmt: skip
    share = labels.mean()
    each = np.where(labels == 1.0, 0.5 / share, 0.5 / (1.0 - share)) / len(labels)
    firsts, seconds = ([np.zeros_like(each_) for each_ in weights] for _ in range(2))
    for step in range(1, STEPS + 1):
        hidden = np.tanh(inputs @ weights[0] + weights[1])
        wrong = each * (_logistic(hidden @ weights[2] + weights[3]) - labels)
        back = np.outer(wrong, weights[2]) * (1.0 - hidden**2)
        slopes = [inputs.T @ back, back.sum(axis=0), hidden.T @ wrong, wrong.sum()]
        for place, slope in enumerate(slopes):
            firsts[place] = 0.9 * firsts[place] + 0.1 * slope
            seconds[place] = 0.999 * seconds[place] + 0.001 * slope**2
            moved = firsts[place] / (1.0 - 0.9**step)
            moved = moved / (np.sqrt(seconds[place] / (1.0 - 0.999**step)) + 1e-8)
            weights[place] = weights[place] - RATE * (moved + DECAY * weights[place])
    return weights


def _logistic(values: np.ndarray) -> np.ndarray:
    return 1.0 / (1.0 + np.exp(-np.clip(values, -30.0, 30.0)))


def predicted(rows: Rows, learned: np.ndarray, labels: np.ndarray, asked: np.ndarray) -> np.ndarray:
    """Train on some rows and predict others: the mean of several networks."""
    middle, spread = rows.inputs[learned].mean(axis=0), rows.inputs[learned].std(axis=0)
    inputs = (rows.inputs - middle) / np.where(spread > 1e-9, spread, 1.0)
    found = np.zeros(asked.sum())
    for seed in range(NETWORKS):
        first, bias, last, level = trained(inputs[learned], labels[learned], seed)
        found += _logistic(np.tanh(inputs[asked] @ first + bias) @ last + level)
    return found / NETWORKS


def scores_of(rows: Rows) -> dict[str, list[tuple[float, float]]]:
    """Return the areas under the curve of each score, of all rows and of hard ones, by part."""
    order = np.random.default_rng(0).permutation(rows.objects.max() + 1)
    part = np.empty(len(order), dtype=int)
    part[order] = np.arange(len(order)) % FOLDS
    known = ~np.isnan(rows.survived)
    synthetic = rows.controls | rows.planned
    found: dict[str, list[tuple[float, float]]] = {}
    for fold in range(FOLDS):
        seen = part[rows.objects] != fold
        asked = ~seen & known
        labels = rows.survived[asked]
        if len(set(labels)) < 2:
            continue
        old = np.where(rows.planned, 1.0, 0.0)
        scores = {
            "Ferrari-Canny": rows.quality[asked],
            "Ferrari-Canny over weight": rows.quality[asked] / rows.weight[asked],
            "network, synthetic negatives": predicted(rows, seen & synthetic, old, asked),
            "network, survival": predicted(rows, seen & known, rows.survived, asked),
        }
        for name, values in scores.items():
            hard = rows.hard[asked]
            areas = area_under_curve(values, labels), area_under_curve(values[hard], labels[hard])
            found.setdefault(name, []).append(areas)
    return found


def make(folder: Path, count: int, meshes: Path | None) -> None:
    """Write meshes of many shapes, and settings for a dataset of them and of scans."""
    files = write_objects(folder, count)
    if meshes is not None:
        files += sorted(path for path in meshes.rglob("*") if path.suffix in {".ply", ".obj"})
    listed = ", ".join(f'"{path}"' for path in files)
    text = SETTINGS.format(objects=listed)
    (folder / "learning.toml").write_text(text, encoding="utf-8")


def main() -> None:
    """Make meshes, or print the areas under the curves of a dataset."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--make", type=int, default=0, help="write so many meshes and settings")
    parser.add_argument("--meshes", type=Path, help="folder of more meshes, PLY or OBJ in metres")
    args = parser.parse_args()
    if args.make:
        make(args.folder, args.make, args.meshes)
        return
    rows = rows_of(args.folder)
    known = ~np.isnan(rows.survived)
    print(
        f"{rows.objects.max() + 1} objects, {len(rows.survived)} rows of four contacts; "
        f"{int((rows.survived == 1.0).sum())} survived, {int((rows.survived == 0.0).sum())} lost, "
        f"{int((known & (rows.quality > 0.0) & (rows.survived == 0.0)).sum())} of these in closure"
    )
    for name, areas in scores_of(rows).items():
        every, hard = np.array(areas).T
        listed = ", ".join(f"{area:.3f}" for area in hard)
        print(f"{name:30} all {every.mean():.3f}, {', '.join(HARD)} {hard.mean():.3f} ({listed})")


if __name__ == "__main__":
    main()
