"""The site's page of every public function and class, from docstrings; `conf.py` has it written."""

import ast
import importlib
import inspect
import re
import textwrap
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import Any

from docstring_parser import DocstringStyle, parse

from grasp_core.settings import Settings
from sim_validate.closure.verdict import HoldsWrenches
from sim_validate.files.result_files import AboutGrasps, ResultFile

PACKAGES = {"grasp_core": "gc", "scenes": "scenes", "sim_validate": "sv"}
UNTOLD = ("Key", "Shape", "Shown", "UNRECORDED", "FLAT")
"""Rules of types that the page leaves out."""
BASES = (ResultFile, AboutGrasps, HoldsWrenches)
"""Bases whose members are told with those of each class."""
INTRODUCTION = """\
# Python reference

Every public function and class, from the docstrings. Units are SI, coordinates are the object's,
and normals point into the object. Wherever `positions` and `normals` are arguments, a grasp may
stand in the place of `positions`; `normals` is then `None`, or left out where it has a default.
"""


def write(path: Path) -> None:
    """Write the page, unless it is there already."""
    text = page()
    if not (path.is_file() and path.read_text(encoding="utf-8") == text):
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8")


def page() -> str:
    """The text of the page."""
    parts = [INTRODUCTION]
    for name, short in PACKAGES.items():
        package = importlib.import_module(name)
        heading = f"import {name}" + (f" as {short}" if short != name else "")
        summary = (package.__doc__ or "").partition("\n")[0]
        parts.append(f"\n## `{heading}`\n\n{summary}\n")
        parts += [entry(short, each, getattr(package, each)) for each in sorted(package.__all__)]
    return "".join(parts)


def entry(short: str, name: str, thing: Any) -> str:
    """What is said of one public name."""
    if inspect.isclass(thing) and thing.__name__ != name:
        return f"\n### class `{short}.{name}`\n\nAnother name of `{short}.{thing.__name__}`.\n"
    if inspect.isclass(thing):
        members = "".join(f"{line}\n" for line in members_of(thing))
        end = f"\n{members}" if members else ""
        return f"\n### class `{short}.{name}`\n\n{described(thing)}{end}"
    if callable(thing):
        return f"\n### `{short}.{name}{signature(thing)}`\n\n{described(thing)}"
    return f"\n### `{short}.{name}`\n\n"


def signature(function: Any) -> str:
    """Names of arguments with their defaults, which are dots where they have no short name."""
    plain = [
        each.replace(annotation=inspect.Parameter.empty)
        for each in inspect.signature(function).parameters.values()
        if each.name not in {"self", "cls"}
    ]
    return re.sub(r"<[^<>]*>", "...", str(inspect.Signature(plain)))


def described(thing: Any) -> str:
    """Its docstring as Markdown."""
    found = parse(inspect.getdoc(thing) or "", style=DocstringStyle.GOOGLE)
    lines = [flowed(text) for text in (found.short_description, found.long_description) if text]
    fields = {each.args[1]: each for each in found.params if len(each.args) > 1}
    said = [f"* `{name}`: {flowed(each.description or '')}" for name, each in fields.items()]
    if found.returns and found.returns.description:
        said.append(f"* returns: {flowed(found.returns.description)}")
    said += [f"* raises `{each.type_name}`: {flowed(each.description or '')}"
             for each in found.raises]  # fmt: skip
    return "\n\n".join([*lines, *(["\n".join(said)] if said else [])]) + "\n"


def flowed(text: str) -> str:
    """Paragraphs on one line each; what is indented stays."""
    parts = [part if part.startswith("    ") else " ".join(part.split())
             for part in text.strip().split("\n\n")]  # fmt: skip
    return "\n\n".join(parts)


class Shown(ast.NodeTransformer):
    """Leaves out of types what only files and tables need, and shapes, which are said in words."""

    def visit_Subscript(self, node: ast.Subscript) -> ast.expr:
        """Reduce `Annotated` to what readers need."""
        self.generic_visit(node)
        if ast.unparse(node.value) != "Annotated" or not isinstance(node.slice, ast.Tuple):
            return node
        kind, *rules = node.slice.elts
        told = [rule for rule in rules if ast.unparse(rule).partition("(")[0] not in UNTOLD]
        return ast.Subscript(node.value, ast.Tuple([kind, *told])) if told else kind


def members_of(kind: type) -> Iterator[str]:
    """Fields with what is said below each, then properties and methods; and those of bases too."""
    for parent in kind.__bases__:
        if parent in BASES or (issubclass(parent, Settings) and parent is not Settings):
            again = tuple(f"* `{name}:" for name in vars(kind).get("__annotations__", {}))
            yield from (line for line in members_of(parent) if not line.startswith(again or "-"))
    yield from own_members_of(kind)


def own_members_of(kind: type) -> Iterator[str]:
    """Members that a class declares itself."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(kind))).body[0]
    if not isinstance(tree, ast.ClassDef):
        raise TypeError(kind)
    for part, after in zip(tree.body, [*tree.body[1:], None], strict=True):
        is_text = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
        said = flowed(str(after.value.value)) if is_text else ""
        if isinstance(part, ast.AnnAssign) and not ast.unparse(part.target).startswith("_"):
            default = f" = {ast.unparse(part.value)}" if part.value else ""
            default = "" if "(" in default else default
            type_shown = ast.unparse(Shown().visit(part.annotation))
            name = f"{ast.unparse(part.target)}: {type_shown}{default}"
        elif isinstance(part, ast.Assign) and isinstance(part.value, ast.Constant):
            name = f"{ast.unparse(part.targets[0])} = {part.value.value!r}"
        elif isinstance(part, ast.FunctionDef) and not part.name.startswith("_"):
            held = inspect.getattr_static(kind, part.name)
            is_value = isinstance(held, property | cached_property)
            name = f".{part.name}" + ("" if is_value else signature(getattr(kind, part.name)))
            said = (ast.get_docstring(part) or "").partition("\n")[0]
        else:
            continue
        yield f"* `{name}`" + (f": {said}" if said else "")
