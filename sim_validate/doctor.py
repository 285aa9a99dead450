"""Runs the command `doctor`, which checks an installation on a tetrahedron with known answers."""

import math
import os
import sys

from grasp_core.closure.critical_friction import critical_friction
from grasp_core.closure.force_closure import force_closure
from grasp_core.compiled import compiled, state_of
from grasp_core.cones.pyramids import inscribed_share
from grasp_core.families.placements import RADIUS_GIVEN_UP
from grasp_core.files.records import record_of
from grasp_core.planning.planner import plan
from grasp_core.provenance import versions
from scenes.drawing.clips import GraphicsError, available_graphics, has_display, remedy
from scenes.example_objects import example_object
from sim_validate.closure.validate import validate
from sim_validate.commands import flags
from sim_validate.commands.console import Reporter
from sim_validate.commands.exit_codes import Exit
from sim_validate.engine.closure_cases import ClosureCase
from sim_validate.engine.known_cases import measured
from sim_validate.engine.setup import Setup
from sim_validate.processes.compiling import EVERYTHING, compile_loops
from sim_validate.processes.workers import available_cores

LOOPS = {
    "kept": "yes",
    "not kept": "yes, but anew in each process: make the cache folder or NUMBA_CACHE_DIR writable",
    "interpreted": "no, NUMBA_DISABLE_JIT says so: unset it, planning is a hundred times slower",
}


def check_installation(command: flags.DoctorFlags, reporter: Reporter) -> int:
    """Plan and simulate a tetrahedron whose answers are known, and report all checks."""
    if command.compile:
        reporter.say("compiling all inner loops, which takes two minutes of one core")
        compile_loops(EVERYTHING, available_cores())
    body, gate = example_object("tetrahedron"), measured(ClosureCase.of(Setup()))
    grasp = plan(body).grasps[0]
    verdict = validate(body, grasp) if gate.passed else None
    cone = math.tan(grasp.force_cones[0].half_angle) * inscribed_share()
    checks = {
        # solvers give up KEPT of the exact radius
        "linear programs": math.isclose(
            3.0 * grasp.radius / body.radius, cone, rel_tol=2.0 * RADIUS_GIVEN_UP
        ),
        "conic programs": force_closure(grasp).verify(),
        "critical friction": critical_friction(grasp) == 0.0,
        **{f"gate: {check.name}": check.passed for check in gate.checks},
        "simulated grasp holds": bool(verdict and verdict.held),
        "simulated controls do not": bool(verdict and verdict.controls and verdict.controls_let_go),
    }
    machine = _machine()
    record = {"versions": versions(), "machine": machine, "gate": record_of(gate)}
    reporter.document(record | {"checks": checks})
    reporter.table("versions", ("what", "version"), list(versions().items()))
    cases = [
        (check.name, f"{check.value:.5g}", f"{check.least:.5g} to {check.largest:.5g}")
        for check in gate.checks
    ]
    reporter.table("the simulator's known cases", ("case", "measured", "must be"), cases)
    states = [("ok" if passed else "FAILED", name) for name, passed in checks.items()]
    reporter.table("checks", ("state", "what"), states)
    for name, state in machine.items():
        reporter.say(f"{name}: {state}")
    failed = [name for name, passed in checks.items() if not passed]
    if not failed:
        reporter.say("all checks passed: plans and verdicts of this installation can be relied on")
        return Exit.GOOD
    reporter.warn(
        f"wrong answers from {', '.join(failed)}: reinstall the package"
        if gate.passed
        else "this MuJoCo does not give the answers of statics, so that `validate` certifies "
        "nothing; install the versions of .ci/constraints.txt"
    )
    return Exit.INTERNAL


def _machine() -> dict[str, str]:
    try:
        graphics = f"MuJoCo draws with {available_graphics() or 'its default'}"
    except GraphicsError as error:
        graphics = f"none ({error}); pictures and reports need none, clips do: {remedy()}"
    look = "yes" if has_display() else "no; use `graspproof view` with --picture, --page or --clip"
    return {
        "Python": sys.executable,
        "cores": f"{available_cores()} to use (--jobs), of {os.cpu_count()}",
        "compiled loops": LOOPS[state_of(compiled("grasp_core.solvers.lp_kernel").solve)],
        "graphics": graphics,
        "display for the viewer": look,
    }
