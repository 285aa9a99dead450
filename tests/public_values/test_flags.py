"""Flags of commands are the settings of the classes that functions take, each with its bounds."""

import math
import re
from collections import Counter
from pathlib import Path
from typing import get_args, get_origin

import pytest

import grasp_core as gc
from grasp_core.hands.hand import HANDS
from grasp_core.kinds import takes
from scenes.settings import PhysicsSettings
from sim_validate.datasets.config import HandName
from sim_validate.kit.flag_values import flags_of, parts_of
from sim_validate.main import COMMANDS

ROOT = Path(__file__).parents[2]


def refuses(kind, value):
    try:
        takes(kind)(value)
    except ValueError:
        return True
    return False


def with_number(kind, number):
    """A value of a type, with one number in it that the others are not."""
    inner = [part for part in get_args(kind) if part is not type(None)]
    if get_origin(kind) is tuple:
        rest = [] if inner[-1] is Ellipsis else [1.0] * (len(inner) - 1)
        return (with_number(inner[0], number), *rest)
    return with_number(inner[0], number) if inner else number


def test_every_number_of_a_command_has_bounds():
    numbers = {
        (flag.owner, flag.field): flag.kind
        for command in COMMANDS.values()
        for flag in flags_of(command)
        if {int, float} & set(map(id_of, parts_of(flag.kind)))
    }
    assert len(numbers) >= 90
    for (_, name), kind in numbers.items():
        for value in (math.nan, math.inf, -math.inf):
            assert refuses(kind, with_number(kind, value)), name
        if tuple in map(get_origin, parts_of(kind)) and int not in parts_of(
            kind
        ):  # it is the number that is refused
            assert not refuses(kind, with_number(kind, 1.0)), name


def id_of(part):
    return part if part in (int, float) else None


@pytest.mark.parametrize("command", sorted(set(COMMANDS) - {"dataset", "baseline"}))
def test_no_two_flags_of_a_command_have_one_name(command):
    counts = Counter(flag.name for flag in flags_of(COMMANDS[command]))
    assert [name for name, count in counts.items() if count > 1] == []


@pytest.mark.parametrize("value", [-1e-3, 1e-6, 1.1])
def test_torsion_has_no_values_that_mujoco_would_raise(value):
    with pytest.raises(gc.InputError, match="torsion_m must be"):
        PhysicsSettings(torsion_m=value)


def test_hands_of_datasets_are_the_built_in_ones():
    assert set(get_args(HandName)) == {"", *HANDS}


FLAG = re.compile(r"(?<![\w-])--[a-z][a-z0-9_-]*(?:\.[a-z0-9_-]+)?")
OTHERS = {
    "--config",
    "--density-kg-m",
    "--grasp-bless",
    "--help",
    "--junitxml",
    "--mjcf",
    "--noise",
    "--nthreads",
    "--patches",
    "--version",
}
"""Flags of other programs, beginnings of groups, and those of every command."""


def test_flags_that_messages_name_exist():
    known = {f"--{flag.name}".replace("_", "-") for kind in COMMANDS.values()
             for flag in flags_of(kind)}  # fmt: skip
    named = 0
    for package in ("grasp_core", "scenes", "sim_validate"):
        for path in (ROOT / package).rglob("*.py"):
            for flag in map(str, FLAG.findall(path.read_text())):
                named += 1
                assert flag.rstrip("-") in known | OTHERS, (path, flag)
    assert named > 100
