"""The tables of files.md, datasets.md and commands.md in docs: `python -m tests.file_reference`.

The page has a line `<!-- fields: verdicts.json -->` where the tables of a file begin, and
`<!-- end -->` where they end. Those of columns of grasps begin with `<!-- columns: GROUP -->`, that
of rankings with `<!-- rankings -->`.
"""

import re
from pathlib import Path
from typing import Any, NamedTuple, get_args

from grasp_core.allowed_values import inside, words
from grasp_core.declared import Declared
from grasp_core.figures import meanings
from grasp_core.files.records import entries
from grasp_core.names import RANKINGS
from grasp_core.settings import Settings
from sim_validate.closure.verdict import Verdicts
from sim_validate.datasets.columns import TABLES, dataset_tables
from sim_validate.execution.verdict import Executions
from sim_validate.hands.reaches import Reaches
from sim_validate.planning.transfer import TransferFile
from sim_validate.protocols.verdict import Judgements

PAGE = Path(__file__).parent.parent / "docs" / "files.md"
DATASETS, COMMANDS = PAGE.parent / "datasets.md", PAGE.parent / "commands.md"
FILES = {kind.FILE: kind for kind in (Verdicts, Executions, Reaches, Judgements, TransferFile)}
IN_FILES = re.compile(r"\b(None|NaN)\b")
"""What JSON lacks: files have null there."""
COLUMNS = re.compile(r"(<!-- columns: ([^>]*?) -->\n).*?(?=<!-- end -->)", re.DOTALL)
RANKED = re.compile(r"(<!-- rankings -->\n).*?(?=<!-- end -->)", re.DOTALL)
MARKED = re.compile(r"(<!-- fields: ([^>]*?) -->\n).*?(?=<!-- end -->)", re.DOTALL)


class Part(NamedTuple):
    """An object of a file: where it stands, and what its keys mean."""

    where: str
    kind: type
    rows: tuple[tuple[str, str], ...]


def described(kind: type) -> list[Part]:
    """Describe a file: its record, and the records inside it, each once and in their order."""
    parts: list[Part] = []
    waiting: list[tuple[str, type]] = [("", kind)]
    for where, each in waiting:
        if all(each is not known.kind for known in parts):
            rows, inner = _rows_of(each, where)
            parts.append(Part(where, each, tuple(rows)))
            waiting += inner
    return parts


def _rows_of(kind: type, where: str) -> tuple[list[tuple[str, str]], list[tuple[str, type]]]:
    """Return the keys of a record with their meaning, and the records inside it."""
    rows: list[tuple[str, str]] = []
    inner: list[tuple[str, type]] = []
    for each in entries(kind):
        found = record_within(each.kind)
        if each.flat is not None:
            more, deeper = _rows_of(each.flat, where)
            rows, inner = rows + more, inner + deeper
            continue
        said = meanings(kind).get(each.name, "")
        if found is not None:
            inner.append((f"{where}.{each.key}".lstrip("."), found))
            said = said or (found.__doc__ or "").partition("\n")[0]
        rows.append((each.key, said or words(each.kind)))
    return rows, inner


def record_within(kind: Any) -> type | None:
    """Return the class of the records that a kind holds, also as items or values; or None."""
    own = inside(kind, Declared)
    inner = (record_within(part) for part in get_args(kind))
    return own or next((found for found in inner if found is not None), None)


def tables_of(file: str, known: dict[type, str]) -> str:
    """The tables of a file: its own keys, then those of each record inside it.

    A record that is `known` from a file before it is not described again.
    """
    said, elsewhere = list[str](), tuple[str, ...]()
    for part in described(FILES[file]):
        if part.where.startswith(elsewhere):
            continue
        if part.kind in known:
            said.append(f"`{part.where}` has the fields of {known[part.kind]}.\n")
            elsewhere += (f"{part.where}.",)
            continue
        known[part.kind] = f"`{part.where}` in {file}"
        if issubclass(part.kind, Settings):
            said.append(
                f"`{part.where}` holds the settings of `{part.kind.__name__}` by their names.\n"
            )
            continue
        if part.where:
            said.append(f"`{part.where}`: {(part.kind.__doc__ or '').partition(chr(10))[0]}\n")
        rows = [f"| `{key}` | {IN_FILES.sub('null', meaning)} |" for key, meaning in part.rows]
        said.append("\n".join(["| field | what |", "|---|---|", *rows, ""]))
    return "\n" + "\n".join(said) + "\n"


def page() -> str:
    """The text of the page with the tables as the classes say them."""
    text, known = PAGE.read_text(encoding="utf-8"), dict[type, str]()
    return MARKED.sub(lambda found: found[1] + tables_of(found[2], known), text)


def columns(group: str) -> str:
    """The columns that grasps have with a group of columns, as their row class says them."""
    usual = {each.name for each in TABLES["grasps"]}
    more = [each for each in dataset_tables({group: 1})["grasps"] if each.name not in usual]
    rows = [f"| `{each.name}` | {each.meaning} |" for each in more]
    return "\n".join(["", "| column | what |", "|---|---|", *rows, "", ""])


def datasets_page() -> str:
    """The text of the page about datasets with the tables as the classes say them."""
    text = DATASETS.read_text(encoding="utf-8")
    return COLUMNS.sub(lambda found: found[1] + columns(found[2]), text)


def commands_page() -> str:
    """The text of the page about commands with the rankings as they are declared."""
    rows = [f"| `{name}` | {what} |" for name, what in RANKINGS.items()]
    table = "\n".join(
        ["", "| `--rank-by` | what the best grasps have |", "|---|---|", *rows, "", ""]
    )
    return RANKED.sub(lambda found: found[1] + table, COMMANDS.read_text(encoding="utf-8"))


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    DATASETS.write_text(datasets_page(), encoding="utf-8")
    COMMANDS.write_text(commands_page(), encoding="utf-8")
