"""`bakery evaluate segment`: the segmentation network, measured."""

import json
from pathlib import Path

import click

from bakery.cli import options

folder = click.Path(path_type=Path)


@click.command(cls=options.Command)
@click.argument("portraits", type=folder, required=False)
@click.option(
    "--weights", "file", type=folder,
    help="Of `bakery train segment-export`; those that ship if not given.",
)  # fmt: skip
@click.option("--bank", type=folder, help="Folder of `bakery synth portraits`, not trained on.")
@click.option("--count", type=click.IntRange(1), help="Painted pictures to look at.")
def segment(portraits, file, bank, count):
    """IoU of classes on painted portraits of BANK; outline, glasses and skin on real ones.

    Painted portraits are labelled as `bakery segment` does it, then by the network alone.
    PORTRAITS is a folder with dense478.npz that holds london and congress; without it, only
    painted portraits are looked at.
    """
    from bakery.detectors import segmenter
    from bakery.evaluate import segmenting

    if not (bank or portraits):
        raise click.UsageError("nothing to measure: give PORTRAITS, --bank or both")
    network = segmenter.load(file) if file else segmenter.shipped()
    if bank:
        if not file:
            click.echo(json.dumps({"stage": segmenting.staged(bank, limit=count)}))
        click.echo(json.dumps({"network alone": segmenting.painted(bank, network, count)}))
    if not portraits:
        return
    rows: list[list] = [[], []]
    for some, lines in (
        (rows[0], segmenting.photographed(portraits / "congress", network)),
        (rows[1], segmenting.skin_lost(portraits, network)),
    ):
        for line in lines:
            click.echo(json.dumps(line))
            some.append(line)
    click.echo(json.dumps(segmenting.summary(*rows)))
    if not file:  # the stage goes by the weights that ship
        from bakery.evaluate import hairlines

        placed = hairlines.placed(portraits, segmenting.stage_classes)
        click.echo(json.dumps({"placed by people": hairlines.summary(list(placed))}))
