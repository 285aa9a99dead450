"""The types of fields that several files have, and the object that a file is about."""

import math
from typing import Annotated, Any, NotRequired, cast

from pydantic import Field
from typing_extensions import TypedDict

from grasp_core.objects.polyhedron import Polyhedron

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Count = Annotated[int, Field(ge=0)]
Triple = tuple[Finite, Finite, Finite]
Wrench = tuple[Finite, Finite, Finite, Finite, Finite, Finite]


class ObjectRecord(TypedDict):
    """Fields about the object that a file is about."""

    name: NotRequired[str]
    source_sha256: NotRequired[str | None]
    content_sha256: str


def object_record(body: Polyhedron) -> ObjectRecord:
    """Record which object a file is about: its name, and hashes of its file and of its mesh."""
    return {
        "name": body.name,
        "source_sha256": body.source_sha256,
        "content_sha256": body.content_sha256,
    }


def finite(value: Any) -> Any:
    """Replace numbers that JSON lacks (NaN, infinity) by null throughout a tree."""
    if isinstance(value, dict):
        return {name: finite(part) for name, part in cast("dict[str, Any]", value).items()}
    if isinstance(value, list | tuple):
        return [finite(part) for part in cast("list[Any]", value)]
    return None if isinstance(value, float) and not math.isfinite(value) else value
