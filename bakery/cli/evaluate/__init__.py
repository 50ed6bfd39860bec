"""`bakery evaluate`: the quality table, measured."""

import json
from pathlib import Path

import click

from bakery.cli import complete, options
from bakery.cli.evaluate import generator as evaluate_generator
from bakery.cli.evaluate import hair as evaluate_hair
from bakery.cli.evaluate import motion as evaluate_motion
from bakery.cli.evaluate import segment as evaluate_segment
from bakery.cli.evaluate import skin as evaluate_skin

portraits = click.argument("portraits", type=click.Path(path_type=Path))


@click.group(cls=options.Group)
def evaluate():
    """Measure the project; one JSON line a photo, then the means.

    PORTRAITS is a folder with dense478.npz, the reference points of the photos that it names.
    """


def _line(record):
    click.echo(json.dumps(record, default=float))


@evaluate.command(cls=options.Command)
@portraits
@options.detector
@click.option("--set", "sets", multiple=True, help="Folder of PORTRAITS; may be repeated.")
@click.option("--stress", is_flag=True, help="Small, tilted, cut and double faces instead.")
@click.option(
    "--hidden", is_flag=True,
    help="Confidence of hidden points instead; PORTRAITS is a folder of `bakery synth portraits`.",
)  # fmt: skip
def detect(portraits, detector, sets, stress, hidden):
    """Distance of detected from reference points, over the outer-eye-corner distance."""
    from bakery.evaluate import detection
    from bakery.evaluate.detection import hidden as detection_hidden
    from bakery.evaluate.detection import stress as detection_stress
    from bakery.plugins import plug_in

    finder, sets = plug_in("detectors", detector), sets or detection.SETS
    if hidden:
        return _line(detection_hidden.measure(portraits, finder))
    if stress:
        for result in detection_stress.stress_folder(portraits, finder, sets):
            click.echo(detection.as_json(result))
        return
    results = []
    for result in detection.measure_folder(portraits, finder, sets):
        click.echo(detection.as_json(result))
        results.append(result)
    click.echo(detection.as_json(detection.summarize(results)))


@evaluate.command(cls=options.Command)
@portraits
@options.head
@click.option(
    "--detector",
    shell_complete=complete.plug_ins("detectors"),
    help="Fit from this detector's landmarks too, as `network`.",
)
def fit(portraits, head, detector):
    """Distance of projected from reference landmarks, in percent."""
    from bakery.evaluate import report
    from bakery.heads.file import load_head

    rows = []
    for row in report.fits(portraits, load_head(head), detector):
        _line(row)
        rows.append(row)
    _line(report.fit_summary(rows))


@evaluate.command(cls=options.Command)
@portraits
@options.head
@click.option(
    "--set", "sets", multiple=True, default=["london/val"], show_default=True,
    help="Folder of PORTRAITS; may be repeated.",
)  # fmt: skip
@click.option(
    "--part", default="", help="What names of photos must hold; neutral ones of london if left out."
)
def outline(portraits, head, sets, part):
    """Ears, neck, side of the face and head in the own photo, without and with the fitted outline."""
    from bakery.evaluate import outline as outlines
    from bakery.heads.file import load_head

    model = load_head(head)
    for start in sets:
        rows = []
        only = part or ("neutral" if start.startswith("london") else "")
        for row in outlines.everybody(portraits, model, start, only):
            _line(row)
            rows.append(row)
        _line({"set": start} | outlines.summary(rows))


@evaluate.command(cls=options.Command)
@click.argument("truth")
@options.head
@click.option("--count", default=20, show_default=True, type=click.IntRange(1))
@click.option("--seed", default=0, show_default=True, type=click.IntRange(0))
def synthetic(truth, head, count, seed):
    """Surface distance of fits to painted heads of the model TRUTH (name or file)."""
    import numpy as np

    from bakery.evaluate import report
    from bakery.heads.file import load_head

    rows = []
    for row in report.synthetic(load_head(truth), load_head(head), count, seed):
        _line(row)
        rows.append(row)
    _line({"portraits": count, "median_mm": float(np.median([row["millimetres"] for row in rows]))})


@evaluate.command(cls=options.Command)
@click.argument("folder", type=click.Path(path_type=Path))
@click.option(
    "--head", "heads", multiple=True, default=["makehuman"], shell_complete=complete.heads,
    help="May be repeated.",
)  # fmt: skip
@click.option("--pictures", type=click.Path(path_type=Path), help="Folder for the drawn views.")
@options.overwrite
def scan(folder, heads, pictures, overwrite):
    """Surface distance of fits to pictures of the scanned head in FOLDER, by our own detection."""
    options.may_fill(pictures, overwrite)
    import numpy as np

    from bakery.evaluate import scan as scans
    from bakery.heads.file import load_head

    truth = scans.read_scan(folder)
    for head in heads:
        rows = []
        for row in scans.measure(truth, load_head(head), pictures=pictures):
            _line(row)
            rows.append(row["median_mm"])
        _line({"head": head, "median_mm": round(float(np.mean(rows)), 3)})


@evaluate.command(cls=options.Command)
@portraits
@options.head
@options.generator
@options.preset
@options.settings
@click.option("--mouths", type=click.IntRange(1), help="Bake this many mouths only.")
@click.option("--pictures", type=click.Path(path_type=Path), help="Folder of side-by-side PNGs.")
@click.option("--only", multiple=True, help="Name of a person; may be repeated.")
@options.overwrite
def avatar(portraits, head, generator, preset, settings, mouths, pictures, only, overwrite):
    """Neutral avatars in their own photos, and smiling as the person smiles."""
    options.may_fill(pictures, overwrite)
    from bakery.evaluate import report
    from bakery.evaluate.avatar import pairs as avatar_pairs
    from bakery.heads.file import load_head
    from bakery.plugins import plug_in

    chosen = options.build_options(preset, settings)
    painter = plug_in("generators", generator)
    results = []
    for result in report.avatars(
        portraits, load_head(head), painter, chosen, mouths, pictures, only
    ):
        scores = ("smile", "own_geometry", "warp")
        _line(vars(result) | {name: vars(getattr(result, name)) for name in scores})
        results.append(result)
    if results:
        _line(avatar_pairs.summary(results))


@evaluate.command(cls=options.Command)
@portraits
@options.head
@click.option(
    "--features", type=click.Path(path_type=Path), help="Weights; the shipped ones if left out."
)
def identity(portraits, head, features):
    """Tell people by their identity features: neutral against smiling of london/val of PORTRAITS."""
    from bakery.evaluate import identity as identities
    from bakery.evaluate import report
    from bakery.generators.identity import WEIGHTS, load_features
    from bakery.heads.file import load_head

    network = load_features(features or WEIGHTS)
    seen = list(identities.faces(report.pairs(portraits), load_head(head)))
    _line(identities.measure(network, seen))


@evaluate.command(cls=options.Command)
@click.argument("names", nargs=-1)
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help="Picture.")
@click.option("--folder", required=True, type=click.Path(path_type=Path), help="For the bundles.")
@options.chosen
@options.head
@options.overwrite
def failures(names, output, folder, preset, settings, head, overwrite):
    """Bake `bakery synth failures`, or those of NAMES: a contact sheet, and what was warned of.

    \b
    bakery evaluate failures --preset small --folder runs/failures -o docs/failures.jpg
    """
    from bakery.evaluate import failures
    from bakery.formats.image import write_image
    from bakery.formats.mark import PAINTED
    from bakery.heads.file import load_head

    options.may_write(output, overwrite, endings=options.PICTURES)
    options.may_fill(folder, overwrite)
    chosen = options.build_options(preset, settings)
    found = list(failures.outcomes(load_head(head), folder, chosen, names or None))
    write_image(output, failures.sheet(found), 90, PAINTED)
    click.echo(failures.table(found))
    options.wrote(output)


@evaluate.command(cls=options.Command)
@options.head
@click.option("--count", default=6, show_default=True, type=click.IntRange(1), help="People.")
@click.option("--seed", default=0, show_default=True, type=click.IntRange(0))
def albedo(head, count, seed):
    """Albedo of painted people: in three lights (CIELAB), from two sides (dB), and from the truth.

    Of every six people one each is of the same tone, from pale to dark.
    """
    from bakery.evaluate import albedo as albedos
    from bakery.heads.file import load_head

    model, rows = load_head(head), []
    for number in range(count):
        subject = albedos.person(model, number, seed)
        rows.append(albedos.measure(model, subject))
        _line({"person": number, "melanin": subject.melanin} | rows[-1])
    _line(albedos.summary(rows))


for command in (
    evaluate_generator.generator, evaluate_generator.painted, evaluate_generator.times,
    evaluate_generator.keys, evaluate_generator.detail, evaluate_generator.rest,
    evaluate_generator.teeth,
    evaluate_motion.track, evaluate_motion.talk, evaluate_motion.expressions, evaluate_motion.animate,
    evaluate_motion.transfer, evaluate_motion.perform,
    evaluate_segment.segment, evaluate_skin.complete, evaluate_hair.hair,
):  # fmt: skip
    evaluate.add_command(command)
