"""`bakery evaluate complete`: hidden skin, filled in and measured."""

import json
from pathlib import Path

import click

from bakery.cli import options


@click.command(cls=options.Command)
@click.argument("portraits", type=click.Path(path_type=Path))
@options.head
@click.option(
    "--resolution", default=1024, show_default=True, type=click.IntRange(512, 4096),
    help="Texels on a side.",
)  # fmt: skip
@click.option(
    "--set", "start", default="london/val", show_default=True, help="Folder of PORTRAITS."
)
@click.option("--pictures", type=click.Path(path_type=Path), help="Folder of side-by-side PNGs.")
@click.option("--only", multiple=True, help="Name of a photo; may be repeated.")
@click.option(
    "--way",
    "chosen",
    multiple=True,
    type=options.ways,
    help="Way to complete; may be repeated (all).",
)
@options.overwrite
def complete(portraits, head, resolution, start, pictures, only, chosen, overwrite):
    """Mouth and chin, forehead and half of faces, hidden and completed in each way."""
    options.may_fill(pictures, overwrite)
    from bakery.evaluate import completion
    from bakery.heads.file import load_head

    ways = completion.ways()
    ways = {name: way for name, way in ways.items() if name in (chosen or ways)}
    results = []
    for name, scores in completion.everybody(
        portraits, load_head(head), ways, start, resolution, pictures, only
    ):
        rows = {
            region: {way: vars(one) for way, one in of.items()} for region, of in scores.items()
        }
        click.echo(json.dumps({"name": name, **rows}))
        results.append(scores)
    if results:
        click.echo(json.dumps(completion.summary(results)))
