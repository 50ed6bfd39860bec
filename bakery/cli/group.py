"""What `bakery --help` needs before any command is imported."""

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
