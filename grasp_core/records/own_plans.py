"""Makes a plan of grasps that a user has chosen or improved, so that it can be saved and shown."""

import math
from collections.abc import Iterable
from functools import partial

from grasp_core.angles import kept_angle
from grasp_core.checked import coefficient, instance, several, shown
from grasp_core.errors import InputError
from grasp_core.objects.on_faces import check_on_faces
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.certify import check_witness
from grasp_core.planning.result import Outcomes, Plan, PlanCounts
from grasp_core.values import FINGERS, Grasp


def plan_of(body: Polyhedron, grasps: Iterable[Grasp], friction: float) -> Plan:
    """Make a plan of given grasps, such as the first few of `gc.iter_grasps` or improved ones.

    Nothing is searched: face quadruples without one of the grasps count as open.

    Args:
        body: The object.
        grasps: Grasps on the faces of `body`, with different ids, the best first.
        friction: Coulomb coefficient that they were planned with.

    Raises:
        InputError: A grasp is not on the object, two have one id, or the witness of one does not
            fit this friction.
    """
    instance(body, Polyhedron, "body")
    coefficient(friction)
    listed = several(grasps, partial(instance, kind=Grasp, name="grasps"), "grasps", "grasps")
    seen = set[str]()
    for grasp in listed:
        if grasp.id in seen:
            raise InputError(f"grasps: two have the id {shown(grasp.id)}; ids must differ")
        seen.add(grasp.id)
        check_on_faces(body, grasp)
        check_witness(body, grasp, friction)
    every = math.comb(len(body.faces), FINGERS)
    held = len({frozenset(grasp.faces) for grasp in listed})
    return Plan(
        body=body,
        grasps=listed,
        friction=friction,
        theta=kept_angle(math.atan(friction)),
        seed=0,
        counts=PlanCounts(len(body.faces), every, None),
        outcomes=Outcomes(held=held, absent=0, open=max(every - held, 0)),
    )
