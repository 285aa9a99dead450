"""The Python of the README and of docs/, checked by pyright: `python -m tests.typed_examples`.

Each block becomes a file of its own, which is named after its page and line, and is checked against
the packages of this checkout. The mode is pyright's usual one, `standard`: in `strict` mode it asks
for the types of every function's arguments, which would be in the way of readers.
"""

import json
import re
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parent.parent
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
BLOCK = re.compile(r"^```(?:python|py)\n(.*?)^```", re.MULTILINE | re.DOTALL)
SETTINGS = {
    "typeCheckingMode": "standard",
    "pythonVersion": "3.11",
    "extraPaths": [str(ROOT)],
    "reportMissingModuleSource": "error",
}

BROUGHT_ALONG = ("torch", "pxr")
"""Packages that readers have, and that are too large to be installed for a check: what comes from
them has no type here."""
UNTYPED = re.compile(r'is not a known attribute of module "(mujoco|pxr\.\w+)"$')
"""What is said of MuJoCo and of pxr, whose compiled parts have no types."""
EXCUSED = {f'Import "{name}" could not be resolved' for name in BROUGHT_ALONG}


def examples(pages: Iterable[Path] = PAGES) -> dict[str, str]:
    """Every block of Python, by a name such as `simulation_line_16`."""
    return {
        f"{page.stem.replace('-', '_')}_line_{text.count(chr(10), 0, block.start()) + 1}": block[1]
        for page in pages
        for text in [page.read_text(encoding="utf-8")]
        for block in BLOCK.finditer(text)
    }


def complaints(found: dict[str, str]) -> list[str]:
    """What pyright says of each block, with the line inside the block."""
    with TemporaryDirectory() as folder:
        for name, code in found.items():
            (Path(folder) / f"{name}.py").write_text(code, encoding="utf-8")
        (Path(folder) / "pyrightconfig.json").write_text(json.dumps(SETTINGS))
        words = ["-m", "pyright", "-p", folder, "--pythonpath", sys.executable, "--outputjson"]
        done = subprocess.run([sys.executable, *words], capture_output=True, text=True, check=False)
    try:
        answer = json.loads(done.stdout)
    except json.JSONDecodeError as error:
        raise SystemExit(f"pyright did not run: {done.stdout}{done.stderr}") from error
    if answer["summary"]["filesAnalyzed"] != len(found):
        raise SystemExit(f"expected {len(found)} files, got {answer['summary']}")
    return [
        f"{Path(each['file']).stem}:{each['range']['start']['line'] + 1}: {each['message']}"
        for each in answer["generalDiagnostics"]
        if each["severity"] == "error"
        and each["message"] not in EXCUSED
        and not UNTYPED.search(each["message"])
    ]


def main() -> int:
    """Print what is wrong; 1 if anything is."""
    found = examples()
    wrong = complaints(found)
    print(*wrong, f"{len(found)} examples, {len(wrong)} complaints of pyright", sep="\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
