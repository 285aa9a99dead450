"""Compiles the inner loops of hands in two processes, before grasps are reached.

Compiling them takes about a minute of one core, once, and more on a busy one. Workers that start
before would each compile all of them.
"""

from grasp_core.arrays import Array
from grasp_core.compiled import compiled
from grasp_core.hands.first_use import compile_checks, compile_posing
from grasp_core.hands.hand import Hand
from grasp_core.hands.named_hands import load_hand
from grasp_core.kept_loops import is_kept
from grasp_core.objects.polyhedron import Polyhedron
from scenes.example_objects import example_object
from sim_validate.parallel.compiling import Calls, compiled_beside

POSING = "grasp_core.hands.pose_kernel"
CHECKS = "grasp_core.hands.collisions_kernel"


def _posing(_points: Array, _normals: Array) -> None:
    compile_posing(load_hand("allegro"), example_object("tetrahedron"))


BESIDE_REACHING: Calls = {POSING: _posing}
"""The kernel that takes longest to compile, which another process does."""


def must_compile() -> bool:
    """Return whether inner loops of hands are not kept yet."""
    return not (is_kept(POSING) and is_kept(CHECKS))


def compile_for_hands(hand: Hand, body: Polyhedron, seed: int, jobs: int) -> None:
    """Compile the loops, in two processes where that is allowed; loops that are kept are loaded."""
    with compiled_beside(jobs, BESIDE_REACHING):
        compile_checks(hand, body, seed)
        compiled(POSING)  # waits for the other process
    compile_posing(hand, body)
