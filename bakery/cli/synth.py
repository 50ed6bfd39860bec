"""`bakery synth`: synthetic portraits, painted by the project."""

from pathlib import Path

import click

from bakery.cli import options


@click.group()
def synth():
    """Paint synthetic portraits; no real person is in them."""


@synth.command("samples", cls=options.Command)
@click.argument("names", nargs=-1)
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help="Folder.")
@options.head
def samples(names, output, head):
    """Paint the portraits of samples/, or those of NAMES, with their landmarks.

    \b
    bakery synth samples -o samples/
    """
    from bakery.heads.file import load_head
    from bakery.synth.samples import write

    for path in write(load_head(head), output, names or None):
        click.echo(path)
