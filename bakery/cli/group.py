"""What `bakery --help` needs before any command is imported."""

import os
import sys

import click

from bakery.errors import nearest


class Interrupted(Exception):
    """Ctrl-C; its text says what comes of it."""


class Group(click.Group):
    """A group of commands that guesses what a mistyped name means."""

    def resolve_command(self, context, arguments):
        name = arguments[0]
        if self.get_command(context, name) is None and not name.startswith("-"):
            near = nearest(name, self.list_commands(context))
            guess = f" Did you mean '{near}'?" if near else ""
            raise click.UsageError(f"No such command '{name}'.{guess}", context)
        return super().resolve_command(context, arguments)


def help_width():
    """Columns of a help text, as click counts them; it would import shutil, which takes 5 ms."""
    try:
        columns = int(os.environ.get("COLUMNS", 0))
    except ValueError:
        columns = 0
    if columns <= 0:
        try:
            columns = os.get_terminal_size(sys.__stdout__.fileno()).columns
        except (AttributeError, ValueError, OSError):  # closed, none, or no terminal
            columns = 0
    return max(min(columns or 80, 80) - 2, 50)
