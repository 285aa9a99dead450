"""Says which cells of a row are not what something else says of them."""

from collections.abc import Iterator, Mapping
from typing import Any

from grasp_core.files.records import entries
from sim_validate.datasets.parquet import agrees


def disagreements(row: object, wanted: Mapping[str, Any], source: str) -> Iterator[str]:
    """Yield cells of a row that something else says otherwise, beyond what their kinds allow."""
    columns = {each.name: each.key for each in entries(type(row))}
    for name, value in wanted.items():
        stated = getattr(row, name)
        if not agrees(type(row), name, stated, value):
            yield f"{columns[name]} is {stated}, but {value} by {source}"
