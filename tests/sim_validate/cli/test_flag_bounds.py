import math
from dataclasses import dataclass, field
from typing import Annotated

import pytest

from grasp_core.errors import InputError
from sim_validate.cli.flag_bounds import FINITE, at_least, check, more_than, not_zero

Finite = Annotated[float, FINITE]
Vector = Annotated[tuple[Finite, Finite, Finite], not_zero(1e-9, 1e9)]


@dataclass
class Inner:
    share: Annotated[float, more_than(0.0, up_to=1.0)] = 0.5


@dataclass
class Flags:
    count: Annotated[int, at_least(1)] | None = None
    point_m: tuple[Finite, Finite, Finite] = (0.0, 0.0, 0.0)
    down: Annotated[tuple[Vector, ...], "repeated"] = ()
    inner: Annotated[Inner, "a group"] = field(default_factory=Inner)
    name: str = ""


@pytest.mark.parametrize(
    "flags",
    [
        Flags(),
        Flags(count=1),
        Flags(down=((0.0, 0.0, -1e-9), (1e9, 0.0, 0.0))),
        Flags(inner=Inner(1.0)),
        Flags(inner=Inner(math.nextafter(0.0, 1.0))),
    ],
)
def test_values_within_bounds_pass(flags):
    check(flags)


@pytest.mark.parametrize(
    ("flags", "said"),
    [
        (Flags(count=0), "--count must be at least 1, got 0"),
        (Flags(point_m=(0.0, math.nan, 0.0)), "--point-m must be finite, got nan"),
        (Flags(point_m=(0.0, 0.0, -math.inf)), "--point-m must be finite, got -inf"),
        (Flags(down=((0.0, 0.0, 1.0), (0.0, 0.0, 0.0))), r"--down must not be zero.*\(0.0, 0.0, 0"),
        (Flags(down=((0.0, 0.0, 2e9),)), r"the largest part is from 1e-09 to 1e\+09, got"),
        (Flags(inner=Inner(0.0)), "--share must be more than 0, at most 1, got 0.0"),
        (Flags(inner=Inner(1.5)), "--share must be more than 0, at most 1, got 1.5"),
        (Flags(inner=Inner(math.nan)), "--share must be more than 0, at most 1, got nan"),
    ],
)
def test_values_out_of_bounds_are_refused_by_the_name_of_their_flag(flags, said):
    with pytest.raises(InputError, match=said):
        check(flags)
