"""Finds models of the package `mujoco-menagerie`, if it is installed: its only door."""

import importlib
from pathlib import Path
from typing import Any

from grasp_core.errors import InputError


def model_path(name: str) -> Path:
    """Return the path of a model's own file, which the package may download first."""
    try:
        menagerie: Any = importlib.import_module("mujoco_menagerie")
    except ImportError as error:
        raise InputError(
            f"menagerie:{name} needs the package mujoco-menagerie: pip install mujoco-menagerie, "
            "or give the path of a model's file"
        ) from error
    robot, _, file = name.partition("/")
    try:
        folder = Path(menagerie.get(robot).path())
    except (menagerie.MenagerieError, KeyError, OSError) as error:
        said = " ".join(str(error).split())[:200]
        raise InputError(f"menagerie:{name} cannot be loaded: {said}") from error
    folder = folder if folder.is_dir() else folder.parent
    hands = sorted(path.name for path in folder.glob("*.xml") if not path.name.startswith("scene"))
    chosen = file or next((each for each in hands if "right" in each), hands[0] if hands else "")
    if chosen not in hands:
        raise InputError(
            f"menagerie:{name}: the model has no file {chosen!r}, but {', '.join(hands) or 'none'}"
        )
    return folder / chosen
