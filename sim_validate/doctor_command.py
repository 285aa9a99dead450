"""The command that checks an installation."""

import math

from grasp_core.closure import force_closure
from grasp_core.concurrent_grasps import PYRAMID_SIDES
from grasp_core.critical import critical_friction
from grasp_core.planner import plan
from grasp_core.versions import versions
from scenes.objects import example_object
from sim_validate import cli
from sim_validate.console import Reporter
from sim_validate.gate import measured_gate
from sim_validate.setup import Setup
from sim_validate.validation import validate


def check_installation(_: cli.Doctor, reporter: Reporter) -> int:
    """Plan and validate the tetrahedron, whose answers are known in closed form."""
    body = example_object("tetrahedron")
    grasp = plan(body).grasps[0]
    gate = measured_gate(Setup())
    verdict = validate(body, grasp) if gate.passed else None
    cone = math.tan(grasp.force_cones[0].half_angle) * math.cos(math.pi / PYRAMID_SIDES)
    checks = {
        "linear programs": math.isclose(3.0 * grasp.radius / body.radius, cone, rel_tol=1e-6),
        "conic programs": force_closure(grasp).verify(),
        "critical friction": critical_friction(grasp) == 0.0,
        **{f"gate: {check.name}": check.passed for check in gate.checks},
        "simulated grasp holds": verdict is not None and verdict.held,
        "simulated controls do not": (
            verdict is not None and verdict.controls_failed and bool(verdict.controls)
        ),
    }
    found = versions()
    reporter.document({"versions": found, "checks": checks})
    rows = [(name, value) for name, value in found.items()]
    rows += [(name, "ok" if passed else "FAILED") for name, passed in checks.items()]
    reporter.table("graspproof doctor", ("what", "state"), rows)
    return cli.Exit.GOOD if all(checks.values()) else cli.Exit.INTERNAL
