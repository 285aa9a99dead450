"""Names that users choose from: families of grasps, methods, rankings, measures and hands."""

from collections.abc import Mapping
from typing import Literal, TypeAlias, get_args

Family: TypeAlias = Literal["concurrent", "pencil", "regulus"]
"""The family of a grasp, by how its four lines of force meet."""
Method: TypeAlias = Literal["concurrent", "pencil", "regulus", "free"]
"""How grasps are searched for: by one of the paper's three constructions, or free of any family."""
METHODS: tuple[Method, ...] = get_args(Method)
ConeKind: TypeAlias = Literal["tilted", "normal"]
RankBy: TypeAlias = Literal[
    "radius", "friction-margin", "ferrari-canny", "payload", "placement", "diverse"
]  # fmt: skip
"""What makes one grasp better than another (see `plan`)."""
RANKINGS: Mapping[RankBy, str] = {
    "radius": "the largest discs, of each family in turn",
    "friction-margin": "the least critical friction",
    "ferrari-canny": "the largest Ferrari-Canny quality",
    "payload": "the largest mass in any orientation under one squeeze with pushes up to 10 N, less "
    "for objects with a radius below 25 mm",
    "placement": "the largest proved chance of closure where the object is off by 2 mm, less for "
    "objects with a radius below 25 mm, and 2 degrees",
    "diverse": "for each next grasp, the largest distance from those before it",
}
MeasureName: TypeAlias = Literal["ferrari-canny", "weight", "task"]
"""Which loads count: wrenches of unit length, the weight in every orientation, or a user's loads.
"""
HANDS = ("allegro", "allegro-urdf", "leap")
