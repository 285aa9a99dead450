"""Runs the command `doctor`, which checks an installation and says how to repair it."""

import math
import os
import sys
from collections.abc import Mapping

from grasp_core.closure.critical_friction import critical_friction
from grasp_core.closure.force_closure import force_closure
from grasp_core.compiled import compiled, state_of
from grasp_core.cones.pyramids import inscribed_share
from grasp_core.families.placements import KEPT
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.planner import plan
from grasp_core.provenance import versions
from grasp_core.values import Grasp
from scenes.drawing.clips import GraphicsError, available_graphics, has_display, remedy
from scenes.example_objects import example_object
from sim_validate.cli import command_flags
from sim_validate.cli.console import Reporter
from sim_validate.cli.exit_codes import Exit
from sim_validate.parallel.processes import available_cores
from sim_validate.records.fields import finite
from sim_validate.records.verdicts import gate_record
from sim_validate.simulation.gate import Gate, measured_gate
from sim_validate.simulation.setup import Setup
from sim_validate.validation.validation import validate

AS_PLANNED = 2.0 * KEPT
"""Relative tolerance of a planned radius, compared with the exact formula; solvers give up half of
it."""
USUAL_KERNEL = "grasp_core.solvers.lp_kernel"
"""Module of one compiled solver loop; it stands for all when their state is reported."""
LOOPS = {
    "kept": "yes",
    "not kept": (
        "yes, but each process spends half a minute on compiling them again: make the user's "
        "cache folder or NUMBA_CACHE_DIR writable"
    ),
    "interpreted": "no, NUMBA_DISABLE_JIT says so: unset it, planning is a hundred times slower",
}
"""Sentences on whether solver loops are compiled, and whether the compiled code is kept on disk."""
GATE = "gate: "
"""Prefix of the names of checks that compare the simulator with known answers."""


def check_installation(_: command_flags.Doctor, reporter: Reporter) -> int:
    """Plan and simulate a tetrahedron whose answers are known, and report all checks."""
    body = example_object("tetrahedron")
    grasp = plan(body).grasps[0]
    gate = measured_gate(Setup())
    checks = _checks(body, grasp, gate)
    machine, found = _machine(), versions()
    record = {"versions": found, "machine": machine, "gate": gate_record(gate), "checks": checks}
    reporter.document(finite(record))
    reporter.table("versions", ("what", "version"), list(found.items()))
    rows = [
        (_state(check.passed), f"{check.value:.5g}", f"{check.least:.5g} to {check.largest:.5g}",
         check.name)
        for check in gate.checks
    ]  # fmt: skip
    columns = ("gate", "measured", "must be", "known case, in simulation")
    reporter.table("is the simulator faithful?", columns, rows)
    own = {name: passed for name, passed in checks.items() if not name.startswith(GATE)}
    reporter.table("checks", ("state", "what"), [(_state(ok), name) for name, ok in own.items()])
    for name, state in machine.items():
        reporter.say(f"{name}: {state}")
    return _concluded(checks, reporter)


def _checks(body: Polyhedron, grasp: Grasp, gate: Gate) -> Mapping[str, bool]:
    """Name every check, and tell whether it passed."""
    verdict = validate(body, grasp) if gate.passed else None
    cone = math.tan(grasp.force_cones[0].half_angle) * inscribed_share()
    return {
        "linear programs": math.isclose(3.0 * grasp.radius / body.radius, cone, rel_tol=AS_PLANNED),
        "conic programs": force_closure(grasp).verify(),
        "critical friction": critical_friction(grasp) == 0.0,
        **{f"{GATE}{check.name}": check.passed for check in gate.checks},
        "simulated grasp holds": verdict is not None and verdict.held,
        "simulated controls do not": (
            verdict is not None and verdict.controls_let_go and bool(verdict.controls)
        ),
    }


def _state(passed: bool) -> str:
    return "ok" if passed else "FAILED"


def _machine() -> Mapping[str, str]:
    """Describe what this machine offers, and what to do if something is missing."""
    try:
        graphics = f"MuJoCo draws with {available_graphics() or 'its default'}"
    except GraphicsError as error:
        graphics = f"none ({error}); pictures and reports need none, clips do: {remedy()}"
    viewer = (
        "yes" if has_display() else "no; use `graspproof view` with --picture, --page or --clip"
    )
    return {
        "Python": sys.executable,
        "cores": f"{available_cores()} to use (--jobs), of {os.cpu_count()}",
        "compiled loops": LOOPS[state_of(compiled(USUAL_KERNEL).solve)],
        "graphics": graphics,
        "display for the viewer": viewer,
    }


def _concluded(checks: Mapping[str, bool], reporter: Reporter) -> int:
    """Report the result of all checks, and return the exit code."""
    failed = [name for name, passed in checks.items() if not passed]
    if not failed:
        reporter.say("all checks passed: plans and verdicts of this installation can be relied on")
        return Exit.GOOD
    if any(name.startswith(GATE) for name in failed):
        reporter.warn(
            "the simulator failed its checks: this MuJoCo does not give the answers of statics, "
            "and `validate` will refuse to certify anything; install the versions of "
            ".ci/constraints.txt"
        )
    else:
        reporter.warn(f"wrong answers from {', '.join(failed)}: reinstall the package")
    return Exit.INTERNAL
