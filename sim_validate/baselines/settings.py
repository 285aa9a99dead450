"""Reads and writes the simulation settings and the choice of trials in a baseline's file."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic_core import to_jsonable_python

from grasp_core.checked import MOST_RANDOM_WRENCHES
from grasp_core.errors import InputError, about
from grasp_core.files.json_text import complaint
from grasp_core.planning.result import Plan
from scenes.mujoco.closure_scene import Surface
from scenes.mujoco.fingertips import FingerSettings
from sim_validate.closure.setup_toml import setup_from_file, setup_from_tables, tables_of
from sim_validate.engine.setup import (
    Agenda,
    LimitSearch,
    NamedWrench,
    Noise,
    Setup,
    with_planned_radius,
)
from sim_validate.execution.settings import TABLE, AskedExecution, execution_table

Count = Annotated[int, Field(ge=0)]


class _Settings(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)

    setup: dict[str, Any]
    surface: Surface
    random_wrenches: Annotated[int, Field(ge=0, le=MOST_RANDOM_WRENCHES)]
    wrenches: dict[str, Annotated[list[float], Field(min_length=6, max_length=6)]]
    limits: LimitSearch
    trials: Count
    noise: dict[str, float]
    seed: Count
    execution: dict[str, Any] | None = None


@dataclass(frozen=True, slots=True)
class How:
    """How the grasps of a baseline are simulated."""

    setup: Setup
    agenda: Agenda
    execution: AskedExecution | None = None


def settings_of(how: How) -> dict[str, Any]:
    """Write how grasps are simulated in the form that a baseline keeps."""
    setup, agenda = how.setup, how.agenda
    settings: dict[str, Any] = {
        "setup": tables_of(setup),
        "surface": setup.surface,
        "random_wrenches": agenda.random_wrenches,
        "wrenches": {each.name: each.wrench.tolist() for each in agenda.wrenches},
        "limits": agenda.limits,
        "trials": agenda.trials,
        "noise": asdict(agenda.noise),
        "seed": agenda.seed,
    }
    if how.execution is not None:
        settings[TABLE] = execution_table(how.execution)
    return to_jsonable_python(settings)


def of_settings(settings: Mapping[str, Any], path: str) -> How:
    """Read how the grasps of a baseline are simulated."""
    try:
        given = _Settings.model_validate(settings)
    except ValidationError as error:
        raise InputError(f"{path}: {complaint(error, _Settings, ['settings'])}") from error
    with about(f"{path}: settings"):
        setup = setup_from_tables(given.setup, Setup(surface=given.surface), "setup")
        agenda = Agenda(
            random_wrenches=given.random_wrenches,
            wrenches=tuple(NamedWrench(name, w) for name, w in given.wrenches.items()),  # pyright: ignore[reportArgumentType] - an array is made of it
            limits=given.limits,
            trials=given.trials,
            noise=Noise.of_table(given.noise, "noise"),
            seed=given.seed,
        )
        execution = None if given.execution is None else AskedExecution.of_table(given.execution)
    return How(setup, agenda, execution)


def setup_for(saved: Plan, path: Path | None) -> Setup:
    """Build the setup of grasps: with their planned fingertips, then with a settings file."""
    setup = Setup(fingers=with_planned_radius(FingerSettings(), saved.finger))
    return setup if path is None else setup_from_file(path, setup)
