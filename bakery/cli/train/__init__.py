"""`bakery train`: everything that ships trained, made again."""

import json
from pathlib import Path

import click

from bakery.cli import options
from bakery.cli.train.detector import bank, detector, export_detector
from bakery.cli.train.identity import identity
from bakery.cli.train.segment import portraits, segment, segment_export
from bakery.cli.train.transfer import transfer, transfer_export

folder = click.Path(path_type=Path)


@click.group(cls=options.Group)
def train():
    """Train the networks of the project, and make its presets."""


def learned(command):
    """The arguments of what is learned from PORTRAITS into a basis with its card beside it."""
    for option in (
        options.overwrite,
        options.head,
        click.option("--commit", default="", help="Commit of this code, for the card."),
        click.option("-o", "--output", required=True, type=folder, help=".safetensors to write."),
        click.argument("portraits", type=folder),
    ):
        command = option(command)
    return command


def _write_basis(training, make, output, commit, overwrite):
    """Write what `make()` learned, (basis, figures), and its card.

    Args:
        training: the module that has `save` and `model_card` of it.
    """
    from bakery.formats import record
    from bakery.formats.files import write_bytes

    card = output.with_suffix(".json")
    options.may_write(output, overwrite)
    options.may_write(card, overwrite)
    basis, figures = make()
    training.save(basis, output)
    write_bytes(card, record.dump(training.model_card(basis, figures, output, commit)))
    click.echo(json.dumps(figures))
    options.wrote(output, card)


@train.command(cls=options.Command)
@learned
def albedo(portraits, output, commit, head, overwrite):
    """Learn the albedo basis from london/train of PORTRAITS; its card goes beside it."""
    from bakery.heads.file import load_head
    from bakery.train import albedo as training
    from bakery.train.subjects import albedo_subjects

    def make():
        model = load_head(head)
        return training.learn(albedo_subjects(portraits, model), model)

    _write_basis(training, make, output, commit, overwrite)


@train.command(cls=options.Command)
@learned
def rest(portraits, output, commit, head, overwrite):
    """Learn how smiles change the skin from london/train of PORTRAITS; its card goes beside it."""
    from bakery.heads.file import load_head
    from bakery.train import rest as training

    def make():
        known = training.ratios(list(training.unwrapped_pairs(portraits, load_head(head))))
        return training.learn(known), training.left_out_error(known)

    _write_basis(training, make, output, commit, overwrite)


@train.command(cls=options.Command)
@learned
def skin(portraits, output, commit, head, overwrite):
    """Learn the skin database from london/train of PORTRAITS; its card goes beside it."""
    from bakery.heads.file import load_head
    from bakery.train import skin as training

    def make():
        model = load_head(head)
        found = list(training.of_photos(portraits, model))
        return training.learn(found), training.left_out_error(found, model)

    _write_basis(training, make, output, commit, overwrite)


@train.command("rest-shape", cls=options.Command)
@learned
def rest_shape(portraits, output, commit, head, overwrite):
    """Learn what smiles leave in the neutral head from london/train and congress/train of PORTRAITS.

    Its card goes beside it.
    """
    from bakery.heads.file import load_head
    from bakery.train import rest_shape as training

    def make():
        model = load_head(head)
        known = training.pairs(list(training.fitted_pairs(portraits, model)), model)
        others = training.means(list(training.fitted_others(portraits, model)), model)
        errors = training.left_out_error(known, model, others=others)
        return training.learn(known, model, others=others), errors

    _write_basis(training, make, output, commit, overwrite)


@train.command("mouths", cls=options.Command)
@click.option("-o", "--output", required=True, type=folder, help="JSON to write.")
@click.option("--count", default=300, show_default=True, type=click.IntRange(1, 300))
@options.head
@options.overwrite
def mouths(output, count, head, overwrite):
    """Choose the mouth poses that are baked: spread evenly over what lips do."""
    from bakery.heads.file import load_head
    from bakery.train.presets import mouth_poses, poses_to_json

    options.may_write(output, overwrite)
    options.write(output, poses_to_json(mouth_poses(load_head(head), count)).encode())
    options.wrote(output)


@train.command("gaze", cls=options.Command)
@click.option("-o", "--output", required=True, type=folder, help="TOML to write.")
@options.overwrite
def gaze(output, overwrite):
    """Choose the gaze directions that are baked: even over the field of view."""
    from bakery.train.presets import gaze_directions, gaze_to_toml

    options.may_write(output, overwrite)
    options.write(output, gaze_to_toml(gaze_directions()).encode())
    options.wrote(output)


@train.command("pairs", cls=options.Command, resumes=True)
@click.argument("photographs", type=folder)
@click.option("-o", "--output", required=True, type=folder, help="Folder of shards.")
@click.option("--dense", type=folder, help="npz with their 478 points; without it, the detector's.")
@options.head
@options.preset
@options.settings
def real_pairs(photographs, output, dense, head, preset, settings):
    """Make training pairs from PHOTOGRAPHS of people in neutral and in other expressions.

    Files are named SUBJECT_neutral.jpg and SUBJECT_EXPRESSION.jpg, or lie in folders named SUBJECT;
    those of CFD and RaFD are known by their own names.

    \b
    bakery train pairs portraits/london/train --dense portraits/dense478.npz -o runs/real
    """
    from bakery.heads.file import load_head
    from bakery.train import folders, real_pairs

    options.may_go_on(output)
    output.mkdir(parents=True, exist_ok=True)
    people = folders.people(photographs)
    points = folders.landmarks_by(dense)
    chosen = options.build_options(preset, settings)
    model = load_head(head)
    for person, error in real_pairs.write_pairs(people, points, model, output, chosen):
        click.echo(json.dumps({"person": person.name, "left_out": str(error) if error else None}))


@train.command("interiors", cls=options.Command, resumes=True)
@click.argument("portraits", type=folder)
@click.option(
    "--starts", default="train", show_default=True, help="How the names of the photos begin."
)
@click.option("-o", "--output", required=True, type=folder, help="Folder of shards.")
@options.head
@options.preset
@options.settings
def interiors(portraits, starts, output, head, preset, settings):
    """Make training pairs of eyes and mouths from single photos, for `bakery train pagan`.

    PORTRAITS is a folder of photos and a dense478.npz with their points.

    \b
    bakery train interiors portraits/congress -o runs/interiors
    """
    from bakery.formats.portraits import reference_points
    from bakery.heads.file import load_head
    from bakery.train.interiors import write_interiors

    options.may_go_on(output)
    photos = reference_points(portraits, starts)
    output.mkdir(parents=True, exist_ok=True)
    chosen = options.build_options(preset, settings)
    for path, left_out in write_interiors(photos, load_head(head), output, chosen):
        click.echo(json.dumps({"photo": path.stem, "left_out": left_out}))


@train.command("pagan", cls=options.Command, resumes=True)
@click.option("--run", required=True, type=folder, help="Folder of the run; goes on where it was.")
@click.option("--pairs", required=True, multiple=True, type=folder, help="Shards; may be repeated.")
@click.option("--steps", type=click.IntRange(1), help="How many steps in all.")
@click.option("--features", type=folder, help="Identity features, .safetensors.")
@options.settings_of("pagan")
def pagan(run, pairs, steps, features, settings):
    """Train the generator on pairs from `bakery synth pairs` and `bakery train pairs`.

    \b
    bakery train pagan --run runs/one --pairs runs/real --pairs runs/painted --steps 20000
    torchrun --nproc-per-node 4 -m -- bakery train pagan --run runs/one --pairs runs/painted

    It computes on a GPU when there is one. A run that was stopped goes on from its checkpoint.
    """
    from bakery.train import pagan

    options.may_go_on(run, marks=["options.json"])
    chosen = options.options_of("pagan", settings, steps=steps)
    network = None
    if features:
        from bakery.generators.identity import load_features

        network = load_features(features)
    for figures in pagan.train(run, pairs, chosen, network):
        click.echo(json.dumps(figures))


@train.command("pagan-export", cls=options.Command)
@click.argument("runs", type=folder, nargs=-1, required=True)
@click.option("-o", "--output", required=True, type=folder, help=".safetensors to write.")
@options.overwrite
def export_pagan(runs, output, overwrite):
    """Pack the averaged weights of a run of `train pagan`, or the mean of several, as it ships."""
    from bakery.train.pagan.export import export

    options.may_write(output, overwrite)
    click.echo(json.dumps(export(runs, output)))
    options.wrote(output)


for command in (bank, detector, export_detector):
    train.add_command(command)
train.add_command(identity)
train.add_command(portraits)
train.add_command(segment)
train.add_command(segment_export)
train.add_command(transfer)
train.add_command(transfer_export)
