"""Flags of commands are the settings of the classes that functions take, each with its bounds."""

import math
from pkgutil import resolve_name
from typing import get_args, get_origin

from grasp_core.allowed_values import value_of
from grasp_core.errors import InputError
from sim_validate.commands.flag_values import flags_of, parts_of
from sim_validate.commands.table import COMMANDS


def refuses(kind, value):
    try:
        value_of(kind, value, "flag")
    except InputError:
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
        for flag in flags_of(resolve_name(f"sim_validate.{command.flags}"))
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
