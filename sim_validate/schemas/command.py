"""Runs the command `schema`, which prints what files may hold."""

from sim_validate.commands.console import Reporter
from sim_validate.commands.exit_codes import Exit
from sim_validate.commands.flags import SchemaFlags
from sim_validate.schemas.file_schemas import FILE_KINDS, named, schema_text


def show_schema(command: SchemaFlags, reporter: Reporter) -> int:
    """Print the JSON Schema of a kind of files on standard output, or list the kinds."""
    if command.kind is not None:
        text = schema_text(named(command.kind))
        print(text, end="")  # noqa: T201 - the document itself, with or without --json
        return Exit.GOOD
    listed = {name: each.called for name, each in FILE_KINDS.items()}
    reporter.document(listed)
    if not reporter.json_only:
        reporter.table("schemas", ["name", "file"], [*listed.items()])
    return Exit.GOOD
