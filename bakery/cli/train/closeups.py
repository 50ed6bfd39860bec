"""`bakery train closeups`: the networks that look closer at eyes and mouth."""

import json
from pathlib import Path

import click

from bakery.cli import options

folder = click.Path(path_type=Path)


@click.command(cls=options.Command, resumes=True)
@click.option("--skins", type=folder, help="Folder of `bakery synth skins`; else all is painted.")
@click.option("--photos", type=folder, help="Folder of photos, to learn from besides.")
@click.option("--dense", type=folder, help="npz with their 478 points.")
@click.option("--run", required=True, type=folder, help="Folder of the run; goes on where it was.")
@click.option("-o", "--output", required=True, type=folder, help=".safetensors to write.")
@options.head
@options.settings_of("closeups")
@options.overwrite
def closeups(skins, photos, dense, run, output, head, settings, overwrite):
    """Train the networks that see eyes and mouth in close-up, on painted people and photos.

    \b
    bakery train closeups --skins runs/skins --photos portraits/london/train \\
        --dense portraits/dense478.npz --run runs/closeups -o closeups.safetensors
    """
    from bakery.heads.file import load_head
    from bakery.train import closeups as training

    options.may_write(output, overwrite)
    options.may_go_on(run, marks=["options.json"])
    if (photos is None) != (dense is None):
        raise click.UsageError("--photos and --dense go together: give both or none")
    chosen = options.training_options("closeups", settings)
    model = load_head(head)
    with options.progress() as progress:
        training.collect(run, model, skins, photos, dense, chosen, progress)
    tensors = []
    for name in ("eye", "mouth"):
        for figures in training.train_part(name, run, model, chosen):
            if "tensors" in figures:
                tensors.append(figures["tensors"])
            else:
                click.echo(json.dumps({"network": name} | figures))
    training.export(*tensors, output)
    options.wrote(output)
