"""Runs the command `schema`, which prints what files may hold."""

from sim_validate.commands.console import Reporter
from sim_validate.commands.exit_codes import Exit
from sim_validate.schemas.file_schemas import KINDS, named, schema_text
from sim_validate.schemas.flags import Schema


def show_schema(command: Schema, reporter: Reporter) -> int:
    """Print the JSON Schema of a kind of files on standard output, or list the kinds."""
    if command.kind is not None:
        text = schema_text(named(command.kind))
        print(text, end="")  # noqa: T201 - the document itself, with or without --json
        return Exit.GOOD
    listed = {name: each.called for name, each in KINDS.items()}
    reporter.document(listed)
    if not reporter.json_only:
        reporter.table("schemas", ["name", "file"], [*listed.items()])
    return Exit.GOOD
