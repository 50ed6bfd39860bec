"""`bakery train closeups`: the networks that look closer at eyes and mouth."""

import json
from pathlib import Path

import click

from bakery.cli import options


@click.command(cls=options.Command)
@click.argument("bundles", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", required=True, type=click.Path(path_type=Path), help="Weights to write."
)
@options.head
@click.option("--set", "settings", multiple=True, metavar="KEY=VALUE", help="Change an option.")
def closeups(bundles, output, head, settings):
    """Train on avatars that are played; the last of BUNDLES is measured, not learned from.

    \b
    bakery train closeups people/*.avatar -o closeups.safetensors --set steps=1200
    """
    from functools import partial

    from bakery import preset, steps
    from bakery.train import closeups as training

    tables = preset.with_settings({}, [f"train.{setting}" for setting in settings])
    chosen = preset.options_from(training.CloseupOptions, tables.get("train", {}), "train")
    modes = steps.load_head(head).identity_basis[: training.MODES]
    with options.progress() as progress:
        opened = [partial(steps.open_avatar, path) for path in bundles]
        samples = training.collect(opened, modes, chosen, progress)
    tensors = []
    for name in ("eyes", "mouths"):
        for figures in training.train_part(name, samples, len(bundles), chosen):
            if "tensors" in figures:
                tensors.append(figures["tensors"])
            else:
                click.echo(json.dumps({"network": name} | figures))
    training.export(*tensors, output)
