"""Records with a part whose fields stand among their own, and which some of them lack."""

import math
from typing import Annotated

import pytest
from pydantic import computed_field

from grasp_core.allowed_values import FLAT, OrInfinity
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError
from grasp_core.figures import Shown, scalars, table
from grasp_core.files.records import from_record, record_of


@declared
class Part(Declared):
    """What a trial found."""

    load: Annotated[OrInfinity, Shown("load", ".2f")]
    names: tuple[str, ...] = ()


@declared
class Whole(Declared):
    """A trial, or the reason why there is none."""

    id: Annotated[str, Shown("trial")]
    found: Annotated[Part | None, FLAT]
    reason: str | None = None

    @computed_field
    @property
    def survived(self) -> Annotated[bool, Shown("survived")]:
        """Whether it was survived."""
        return self.found is not None


BOTH = Whole("a", Part(math.inf, ("x", "y"))), Whole("b", None, "none")


@pytest.mark.parametrize("value", BOTH)
def test_a_record_may_lack_its_flat_part(value):
    assert from_record(Whole, record_of(value)) == value


def test_the_keys_of_a_flat_part_are_there_or_not():
    one, other = map(record_of, BOTH)
    assert one == {"id": "a", "load": None, "names": ["x", "y"], "reason": None, "survived": True}
    assert other == {"id": "b", "reason": "none", "survived": False}
    with pytest.raises(InputError, match="load: missing"):
        from_record(Whole, {**other, "names": []})


def test_figures_of_a_flat_part_are_those_of_the_record():
    assert table(BOTH, Whole) == (
        ["trial", "load", "survived"], [("a", "never", "yes"), ("b", "-", "no")],
    )  # fmt: skip
    assert scalars(BOTH[0]) == {
        "id": "a", "load": math.inf, "names": 2, "reason": None, "survived": True,
    }  # fmt: skip
    assert scalars(BOTH[1]) == {"id": "b", "reason": "none", "survived": False}
