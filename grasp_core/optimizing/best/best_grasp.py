"""Finds the best grasp of an object, up to a gap, and proves the gap.

Good contacts are found first (`incumbents`), and a bound by a single twist. Then one threshold
after another is refuted (`levels`), each by a tree of cuts (`searching`).
"""

from collections.abc import Callable

from numpy.typing import ArrayLike

from grasp_core.checked import BOUNDS, coefficient, function, number, seed_of, whole
from grasp_core.errors import InputError
from grasp_core.objects.on_faces import check_body
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.optimizing.best.levels import Levels
from grasp_core.optimizing.best.result import BestGrasp, GapAt
from grasp_core.optimizing.best.searching.stop import stopping
from grasp_core.optimizing.better_contacts import FINGER_RADIUS
from grasp_core.quality.measures import Measure, MeasureName

MOST_JOBS = 256
"""Most threads: no machine that is known has more use for them."""


def best_grasp(  # noqa: PLR0913 - each is a quantity of its own
    body: Polyhedron,
    friction: float = 0.5,
    *,
    gap: float = 0.05,
    time_limit_s: float | None = None,
    measure: MeasureName = "ferrari-canny",
    wrenches: ArrayLike | None = None,
    clearance: float | None = None,
    seed: int = 0,
    jobs: int = 1,
    progress: Callable[[GapAt], None] | None = None,
) -> BestGrasp:
    """Find four contacts of the largest quality on an object, and bound the quality of all others.

    All sets of faces count, also with several contacts on one face. The same grasp and proof are
    found on any number of threads, unless the time limit or an interrupt ends the search.

    Args:
        body: The object, with planar faces.
        friction: Coulomb coefficient at every contact.
        gap: Share of the bound that the quality may be below it.
        time_limit_s: Time after which the search stops with the gap reached [s]; it may take some
            seconds more.
        measure: What is maximised, with normal forces that sum to one newton: the Ferrari-Canny
            quality `l1`, with torques about the centre of mass over the object's radius; the
            `weight` that is held in every orientation [N]; or the multiple of all wrenches of a
            `task` that is resisted.
        wrenches: The external (force, torque) of a task, torque about the centre of mass, (m, 6)
            [N, N m], m up to 100; None for other measures.
        clearance: How far contacts stay from the edges of faces [m], or half the radius of the
            largest disc in a face where that is less; a twentieth of the object's radius if None.
        seed: Seed of the random contacts and twists to begin with.
        jobs: How many threads search.
        progress: Called whenever the bound or the quality has improved.

    Returns:
        The grasp and the proof. An interrupt (Ctrl-C) once there is a grasp ends the search like
        the time limit.

    Raises:
        InputError: An argument is out of range, or no contacts in force closure are found.
        SolverError: A program's answer failed its check.
    """
    check_body(body)
    if body.patches is not None:
        raise InputError(
            f"best_grasp: expected an object with planar faces, got {body.name} with curved ones; "
            "take a mesh with fewer, planar faces"
        )
    friction, seed = coefficient(friction), seed_of(seed)
    number(gap, "gap", **BOUNDS["gap"])
    loads = Measure.of(measure, wrenches, body.radius)
    jobs = min(whole(jobs, "jobs", least=1), MOST_JOBS)
    if progress is not None:
        function(progress, "progress")
    if time_limit_s is not None:
        number(time_limit_s, "time_limit_s", **BOUNDS["time_limit_s"])
    if clearance is None:
        clearance = FINGER_RADIUS * body.radius
    number(clearance, "clearance", least=0.0, most=body.radius, where=", the object's radius in m")
    with stopping(time_limit_s) as stop:
        levels = Levels(body, friction, loads, clearance, seed, jobs, stop, progress)
        return levels.result(levels.closed_to(gap))
