"""All cases, by group."""

from tests.bad_input import (
    of_archives,
    of_binary_meshes,
    of_data_files,
    of_files,
    of_obj,
    of_physics,
    of_surroundings,
    of_topology,
)
from tests.bad_input.cases import Case

GROUPS = (
    of_files,
    of_obj,
    of_binary_meshes,
    of_archives,
    of_topology,
    of_physics,
    of_data_files,
    of_surroundings,
)


def all_cases() -> list[Case]:
    """Every case of every group."""
    return [case for group in GROUPS for case in group.cases()]
