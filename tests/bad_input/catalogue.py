"""All cases, by group."""

from importlib import import_module

from tests.bad_input.cases import Case

GROUPS = (
    "of_files", "of_obj", "of_binary_meshes", "of_topology", "of_physics",
    "of_data_files", "of_surroundings",
)  # fmt: skip
"""Modules; the last three make whole files first, which takes a while."""


def cases_of(group: str) -> list[Case]:
    """Every case of a group."""
    return import_module(f"tests.bad_input.{group}").cases()
