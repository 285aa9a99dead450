"""The notebooks of docs/ with what they print: `python -m tests.notebooks` runs them again."""

import os
import sys
from pathlib import Path

import nbformat
from nbclient import NotebookClient

FOLDER = Path(__file__).parent.parent / "docs" / "notebooks"
NOTEBOOKS = tuple(sorted(FOLDER.glob("*.ipynb")))
LONGEST_CELL_S = 300
"""How long a cell may take [s]; where kernels have to be compiled the first ones need a minute."""


def executed(path: Path, folder: Path) -> nbformat.NotebookNode:
    """A notebook with new outputs, run in an empty folder."""
    notebook = nbformat.read(path, as_version=4)
    client = NotebookClient(
        notebook, timeout=LONGEST_CELL_S, record_timing=False, coalesce_streams=True,
        resources={"metadata": {"path": str(folder)}},
    )  # fmt: skip
    return client.execute(env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))})


def printed(notebook: nbformat.NotebookNode) -> list[list[str]]:
    """What each cell of code shows: its text, and for a picture that it is one."""
    return [
        [shown(output) for output in cell.outputs]
        for cell in notebook.cells
        if cell.cell_type == "code"
    ]


def shown(output: nbformat.NotebookNode) -> str:
    if output.output_type == "stream":
        return f"{output.name}: {output.text}"
    if "image/png" in output.get("data", {}):
        return "picture"
    return str(output.get("data", {}).get("text/plain", output))


def main() -> None:
    import tempfile

    for path in NOTEBOOKS:
        with tempfile.TemporaryDirectory() as folder:
            notebook = executed(path, Path(folder))
        for cell in notebook.cells:
            cell.metadata = {}
        notebook.metadata = {"kernelspec": notebook.metadata.kernelspec}
        nbformat.write(notebook, path)
        print(path)


if __name__ == "__main__":
    main()
