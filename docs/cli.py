"""Write docs/cli.md, the reference of every command, from the commands themselves.

    .venv/bin/python docs/cli.py        # or: make cli

tests/cli/test_reference.py holds the page to the commands.
"""

from collections.abc import Iterator
from pathlib import Path

import click

from bakery.cli.main import COMMANDS, bakery

PAGE = Path(__file__).with_name("cli.md")
WIDTH = 78  # columns of a help text
ABOUT = """# Every command, every option

Written from the commands by `make cli`; do not change it here. [commands.md](commands.md) says what each is for.
Every command takes `--help`. Results go to files or stdout, all else to stderr; exit code 1 is a problem that the message
says how to mend, 2 wrong usage, 130 Ctrl-C.
"""


def entries(command: click.Command, parent: click.Context, name: str) -> Iterator[tuple[str, str]]:
    """The name and the help text of a command, and of those that it groups."""
    context = command.context_class(
        command, info_name=name, parent=parent, terminal_width=WIDTH, max_content_width=WIDTH
    )
    yield context.command_path, command.get_help(context)
    if isinstance(command, click.Group):
        for inner in command.list_commands(context):
            found = command.get_command(context, inner)
            if found is not None and not found.hidden:
                yield from entries(found, context, inner)


def reference() -> str:
    """The page; commands of plug-ins are not in it."""
    settings = bakery.context_settings | {"terminal_width": WIDTH}  # -h, as users have it
    root = bakery.context_class(bakery, info_name="bakery", **settings)
    found = []
    for name in COMMANDS:
        command = bakery.get_command(root, name)
        found += list(entries(command, root, name))
    listed = [f"- [`{path}`](#{path.replace(' ', '-')})" for path, _ in found]
    texts = [f"## {path}\n\n```text\n{text.rstrip()}\n```\n" for path, text in found]
    return "\n".join([ABOUT, *listed, "", *texts])


if __name__ == "__main__":
    PAGE.write_text(reference(), encoding="utf-8")
