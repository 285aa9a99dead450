"""The tables of docs/files.md and docs/datasets.md: `python -m tests.file_reference`.

The page has a line `<!-- fields: verdicts.json -->` where the tables of a file begin, and
`<!-- end -->` where they end. Those of columns of grasps begin with `<!-- columns: GROUP -->`.
"""

import re
from pathlib import Path

from grasp_core.figures import described
from grasp_core.settings import Settings
from sim_validate.closure.verdict import Verdicts
from sim_validate.datasets.rows import TABLES, dataset_tables
from sim_validate.execution.verdict import Executions
from sim_validate.hands.reaches import Reaches
from sim_validate.planning.transfer import TransferFile
from sim_validate.protocols.verdict import Judgements

PAGE = Path(__file__).parent.parent / "docs" / "files.md"
DATASETS = PAGE.parent / "datasets.md"
FILES = {kind.FILE: kind for kind in (Verdicts, Executions, Reaches, Judgements, TransferFile)}
IN_FILES = re.compile(r"\b(None|NaN)\b")
"""What JSON lacks: files have null there."""
COLUMNS = re.compile(r"(<!-- columns: ([^>]*?) -->\n).*?(?=<!-- end -->)", re.DOTALL)
MARKED = re.compile(r"(<!-- fields: ([^>]*?) -->\n).*?(?=<!-- end -->)", re.DOTALL)


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


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    DATASETS.write_text(datasets_page(), encoding="utf-8")
