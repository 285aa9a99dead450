"""Settings of plans: which grasps of an object are looked for, and how."""

from typing import Annotated

from annotated_types import Len

from grasp_core.allowed_values import Count, Friction, NotNegative, Quantity, Seed, TimeLimit
from grasp_core.declared import declared
from grasp_core.names import METHODS, ConeKind, Method, RankBy
from grasp_core.settings import Settings


@declared
class PlanSettings(Settings):
    """Which grasps to plan."""

    friction: Friction = 0.5
    """Coulomb coefficient at every contact."""
    families: Annotated[tuple[Method, ...], Len(1)] = METHODS
    """Families of grasps to construct. `free` looks for grasps of any type on the faces that the
    other families leave over. For faces without a grasp it proves that they have none, or says that
    it is undecided."""
    theta_deg: Quantity | None = None
    """Half-angle of the friction cones to plan with [deg]; if not given, that of the friction
    coefficient."""
    cones: ConeKind = "tilted"
    """Axes of the force cones that grasps are constructed with: only the face normals, as in the
    paper, or tilted ones too, which serve boxes, prisms and any friction."""
    limit: Count | None = None
    """Keep at most this many grasps, the best ones; if not given, all."""
    rank_by: RankBy = "radius"
    """What the best grasps have; see `grasp_core.names.RANKINGS`."""
    max_face_parts: Count = 1
    """Number of parts into which the family `free` may divide the four faces while it is undecided.
    """
    complete: bool = False
    """Divide the faces on which it is undecided whether a grasp exists, until each case is decided.
    """
    edge_clearance_m: NotNegative = 0.0
    """How far contacts and their regions stay from the edges of their faces [m]."""
    share_faces_m: NotNegative | None = None
    """Let two fingers stand on one face, at least this far apart [m]."""
    seed: Seed = 0
    """Seed of all random choices."""
    time_limit_s: TimeLimit | None = None
    """Time after which planning ends with what is found by then [s]; the plan then says that it is
    not complete. If not given, there is no limit."""
