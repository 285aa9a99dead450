"""Writes the README.md of a dataset, for people and for the Hugging Face Hub.

The Hub, a website for datasets, calls this page a card; `card.md.jinja` holds its sentences. A
user's own words are escaped: in the header as quoted strings, in the text as Markdown.
"""

import inspect
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from grasp_core.hands.hand import Hand
from scenes.drawing.pages import filled
from sim_validate.datasets.columns import ROW_CLASSES
from sim_validate.datasets.config import (
    KEYS,
    REFERENCES,
    SPLITS,
    DatasetConfig,
    settings_text,
)
from sim_validate.datasets.manifest import Manifest
from sim_validate.files.toml_files import quoted

HUB_SIZES = ("1K", "10K", "100K", "1M", "10M", "100M", "1B", "10B", "100B")
"""Powers of ten, from a thousand, as the Hugging Face Hub names sizes of datasets."""
MARKDOWN_MARKS = frozenset("\\`*_[]<>|~&#!$@")
SPDX = re.compile(r"[A-Za-z0-9.+-]+")
"""Pattern of a licence's name in SPDX; in small letters it is that of the Hugging Face Hub, but for
a few such as ODbL-1.0, there `odbl`."""
ADDRESS = re.compile(r"https?://[^\s<>\"'`\\|{}^]+")


def card_text(config: DatasetConfig, manifest: Manifest, hand: Hand | None = None) -> str:
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
        settings=settings_text(config),
        manifest=manifest,
        rows=rows,
        tables=tables,
        executed=config.execution,
        hand=hand,
        hand_asked=config.hand,
        joints=[] if hand is None else list(_joints(hand)),
        hub_license=config.license.lower() if SPDX.fullmatch(config.license) else "",
        credits={
            "Creator": _as_markdown(config.creator),
            "Address": _as_address(config.url),
            "Published": _as_markdown(config.published),
            "Licence": _as_address(config.license),
        },
        size=_size(sum(rows.values())),
        chances=", ".join(reversed(chances)),
        split=next(iter(of_grasps), "train"),
        quoted=quoted,
        markdown=_as_markdown,
        references=REFERENCES,
    )


def _size(rows: int) -> str:
    place = min(max(len(str(rows)) - 3, 0), len(HUB_SIZES) - 1)
    return f"{HUB_SIZES[place - 1]}<n<{HUB_SIZES[place]}" if place else f"n<{HUB_SIZES[0]}"


def _tables(manifest: Manifest) -> Iterator[Mapping[str, Any]]:
    for name, columns in manifest.tables.items():
        splits = {
            split: manifest.count(name, split)
            for split, _ in reversed(SPLITS)
            if manifest.of_table(name, split)
        }
        yield {
            "name": name,
            "row": inspect.getdoc(ROW_CLASSES[name]),
            "splits": splits,
            "sorted_by": " and ".join(f"`{key}`" for key in KEYS[name]),
            "columns": columns,
        }


def _joints(hand: Hand) -> Iterator[Mapping[str, Any]]:
    """Yield what the card says of each joint, in the order of the columns of joint angles."""
    followed = {each.joint: each.equation for each in hand.couplings}
    fingers = [finger.name for finger in hand.fingers for _ in finger.links]
    for joint, finger, (low, high) in zip(hand.joints, fingers, hand.ranges.tolist(), strict=True):
        yield {
            "name": _as_markdown(joint.name),
            "finger": _as_markdown(finger),
            "range": f"{low:.4g} to {high:.4g}",
            "torque": "" if joint.torque_limit_n_m is None else f"{joint.torque_limit_n_m:g}",
            "follows": _as_markdown(followed.get(joint.name, "")),
        }


def _as_address(text: str) -> str:
    """Write a web address as a link, and any other text of a user as Markdown."""
    if text.isprintable() and ADDRESS.fullmatch(text) is not None:
        return f"<{text}>"
    return _as_markdown(text)


def _as_markdown(text: str) -> str:
    """Write a user's text on one line, with all Markdown and HTML escaped."""
    line = "".join(letter if letter.isprintable() else " " for letter in text).strip()
    return "".join(f"\\{letter}" if letter in MARKDOWN_MARKS else letter for letter in line)
