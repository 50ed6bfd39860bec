"""`bakery evaluate hair`: hair with volume, measured."""

import json
from pathlib import Path

import click

from bakery.cli import options


@click.command(cls=options.Command)
@click.argument("portraits", type=click.Path(path_type=Path))
@options.head
@click.option("--set", "name", default="london/val", show_default=True, help="Folder of PORTRAITS.")
@click.option("--part", default="neutral", show_default=True, help="What names of photos hold.")
@click.option("--count", type=click.IntRange(1), help="Photos to look at.")
def hair(portraits, head, name, part, count):
    """IoU of the silhouettes of head and hair with the photo's, above the chin.

    PORTRAITS is a folder with dense478.npz. Photos need a plain backdrop, which tells the truth;
    others are left out. "bare" is the head without hair, "outside" what lies outside the face.

    \b
    bakery evaluate hair portraits/ --set congress/val --part ""
    """
    from bakery.evaluate.hair import silhouettes, summary
    from bakery.heads.file import load_head

    rows = []
    for row in silhouettes(portraits, name, part, load_head(head), count):
        click.echo(json.dumps(row))
        rows.append(row)
    click.echo(json.dumps(summary(rows)))
