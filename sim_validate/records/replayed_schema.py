"""The fields of `verdicts.json` that are needed to simulate one of its trials again."""

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from grasp_core.checked import MOST_RANDOM_WRENCHES
from scenes.mjcf import Surface

Finite = Annotated[float, Field(allow_inf_nan=False)]
Count = Annotated[int, Field(ge=0)]


class _Record(BaseModel):
    """A record whose unknown fields are ignored, because a replay does not need them."""

    model_config = ConfigDict(frozen=True, extra="ignore", strict=True)


class _Object(_Record):
    content_sha256: str


class _Trial(_Record):
    name: str
    wrench: tuple[Finite, Finite, Finite, Finite, Finite, Finite]
    outcome: str


class _Control(_Record):
    wrenches: list[_Trial]


class _Lost(_Record):
    trial: Count
    wrench: str
    outcome: str


class _Robustness(_Record):
    trials: Count
    not_held: list[_Lost]
    noise: dict[str, Finite]


class _Settings(_Record):
    physics: dict[str, Any]
    fingers: dict[str, Any]
    hold: dict[str, Any]
    limit: dict[str, Any]
    friction: dict[str, Any]
    surface: Surface
    random_wrenches: Annotated[int, Field(ge=0, le=MOST_RANDOM_WRENCHES)]
    seed: Count


class VerdictToReplay(_Record):
    """The fields of one grasp's verdict that a replay needs."""

    id: str
    contacts_sha256: str
    wrenches: list[_Trial]
    controls: dict[str, _Control]
    robustness: _Robustness | None = None
    settings: _Settings


class VerdictsToReplay(_Record):
    """The fields of a whole `verdicts.json` that a replay needs."""

    object: _Object
    friction: Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
    verdicts: list[VerdictToReplay]
