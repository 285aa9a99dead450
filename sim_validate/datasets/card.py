"""Writes the README.md of a dataset, which describes it to people and to the Hugging Face Hub.

The Hub is a website for datasets and calls this page a card; `card.md.jinja` holds its sentences. A
user's own words are escaped: in the header as quoted strings, in the text as Markdown.
"""

import inspect
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from scenes.drawing.pages import filled
from sim_validate.datasets.config import DatasetConfig, config_to_toml, quoted
from sim_validate.datasets.manifest import Manifest
from sim_validate.datasets.rows import ROWS
from sim_validate.datasets.tables import KEYS, REFERENCES, SPLITS, Name

CARD = "README.md"
SIZES = (
    (10**3, "n<1K"), (10**4, "1K<n<10K"), (10**5, "10K<n<100K"), (10**6, "100K<n<1M"),
    (10**7, "1M<n<10M"), (10**8, "10M<n<100M"), (10**9, "100M<n<1B"), (10**10, "1B<n<10B"),
)  # fmt: skip
"""Bounds on the number of rows, and the name that the Hugging Face Hub has for datasets below each.
"""
LARGEST = "10B<n<100B"
MARKS = frozenset("\\`*_[]<>|~&#!$@")
"""Characters that can begin Markdown or HTML within a line."""
SPDX = re.compile(r"[A-Za-z0-9.+-]+")
"""Pattern of a licence's name in SPDX; in small letters it is that of the Hugging Face Hub, but for
a few such as ODbL-1.0, there `odbl`."""
ADDRESS = re.compile(r"https?://[^\s<>\"'`\\|{}^]+")
"""Pattern of a web address that can stand in Markdown as a link unchanged."""


def card_text(config: DatasetConfig, manifest: Manifest) -> str:
    """Write the README.md of a dataset."""
    rows, tables = manifest.rows, list(_tables(manifest))
    (of_grasps,) = (table["splits"] for table in tables if table["name"] == "grasps")
    chances = [
        f"{name} {upto - before:.0%}"
        for (name, upto), before in zip(SPLITS, (0.0, *(upto for _, upto in SPLITS)), strict=False)
    ]
    return filled(
        "card.md.jinja",
        Path(__file__).parent,
        config=config,
        settings=config_to_toml(config),
        manifest=manifest,
        rows=rows,
        tables=tables,
        executed=config.execution,
        hub_license=config.license.lower() if SPDX.fullmatch(config.license) else "",
        credits={
            "Creator": _as_markdown(config.creator),
            "Address": _as_address(config.url),
            "Published": _as_markdown(config.published),
            "Licence": _as_address(config.license),
        },
        size=next((size for upto, size in SIZES if sum(rows.values()) < upto), LARGEST),
        chances=", ".join(reversed(chances)),
        split=next(iter(of_grasps), "train"),
        quoted=quoted,
        markdown=_as_markdown,
        references=_reference,
    )


def _tables(manifest: Manifest) -> Iterator[Mapping[str, Any]]:
    for name, columns in manifest.tables.items():
        splits = {
            split: sum(each.rows or 0 for each in manifest.of_table(name) if each.split == split)
            for split, _ in reversed(SPLITS)
            if any(each.split == split for each in manifest.of_table(name))
        }
        keys = " and ".join(f"`{key}`" for key in KEYS[name])
        yield {
            "name": name,
            "row": inspect.getdoc(ROWS[name]),
            "splits": splits,
            "sorted_by": keys,
            "columns": columns,
        }


def _reference(table: Name, column: str) -> str:
    """Say which row of another table a column names; empty if it names none."""
    if (target := REFERENCES.get((table, column))) is None:
        return ""
    return f" Names a row of `{target[0]}` by its `{target[1]}`."


def _as_address(text: str) -> str:
    """Write a web address as a link, and any other text of a user as Markdown."""
    if text.isprintable() and ADDRESS.fullmatch(text) is not None:
        return f"<{text}>"
    return _as_markdown(text)


def _as_markdown(text: str) -> str:
    """Write a user's text on one line, with all Markdown and HTML escaped."""
    line = "".join(letter if letter.isprintable() else " " for letter in text).strip()
    return "".join(f"\\{letter}" if letter in MARKS else letter for letter in line)
