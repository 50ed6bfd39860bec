"""`bakery shapes`: the names that expressions are made of."""

import json

import click

from bakery.cli import options


@click.command(cls=options.Command)
@options.as_json
def shapes(as_json):
    """List the 52 shapes for --weights, and the expressions that have names.

    \b
    bakery shapes
    bakery shapes --json | jq '.expressions.laugh'
    """
    from bakery.formats.targets import named_expressions
    from bakery.types import EXPRESSIONS

    named = named_expressions()
    if as_json:
        click.echo(json.dumps({"shapes": EXPRESSIONS, "expressions": named}, indent=2))
        return
    click.echo("shapes, each 0 to 1:")
    for first in range(0, len(EXPRESSIONS), 3):
        click.echo("".join(f"  {name:22}" for name in EXPRESSIONS[first : first + 3]).rstrip())
    click.echo("\nexpressions:")
    for name, weights in named.items():
        what = ", ".join(f"{shape} {weight:g}" for shape, weight in weights.items())
        click.echo(click.wrap_text(what or "at rest", 100, f"  {name:14} ", 17 * " "))
