"""`bakery evaluate track`, `talk`, `expressions` and `animate`: motion, measured."""

import json
from pathlib import Path

import click

from bakery.cli import options
from bakery.cli.animate import timecode_base


@click.command(cls=options.Command)
@options.head
@click.option("--people", default=2, show_default=True, type=click.IntRange(1))
@click.option("--frames", default=60, show_default=True, type=click.IntRange(10))
@click.option(
    "--seed", default=1, show_default=True, type=click.IntRange(0), help="Of the first person."
)
def track(head, people, frames, seed):
    """Track painted people who play known curves; about a second a frame goes into painting."""
    from bakery.evaluate import tracking
    from bakery.heads.file import load_head
    from bakery.plugins import plug_in

    model, detector = load_head(head), plug_in("detectors", "network")
    results = []
    for number in range(seed, seed + people):
        results.append(tracking.measure(model, detector, number, frames))
        click.echo(json.dumps(vars(results[-1])))
    click.echo(json.dumps(tracking.summary(results)))


@click.command(cls=options.Command)
@click.argument("clips", type=click.Path(path_type=Path))
@options.detector
@options.head
def talk(clips, detector, head):
    """How well lips are seen to move in CLIPS of talking people.

    CLIPS is a folder with dense478.npz, the reference points of every frame of the clips that it
    names.
    """
    from bakery.evaluate.detection import talk
    from bakery.heads.file import load_head
    from bakery.plugins import plug_in

    finder, model, rows = plug_in("detectors", detector), load_head(head), []
    for path, reference in talk.clips(clips):
        rows.append(talk.measure(path, reference, finder, model))
        click.echo(json.dumps(rows[-1]))
    click.echo(json.dumps(talk.summary(rows)))


@click.command(cls=options.Command)
@click.argument("folders", nargs=-1, required=True, type=click.Path(path_type=Path))
@options.detector
@options.head
def expressions(folders, detector, head):
    """How far people smile in FOLDERS of photos, beside the expressions of a head model.

    NAME_neutral.jpg and NAME_smiling.jpg are one person. A Markdown table: percentiles of smiles
    with closed and with open lips, then the named expressions and some shapes, both sides at 1.

    \b
    bakery evaluate expressions portraits/london/train portraits/congress/train
    bakery heads describe makehuman     # all shapes against their descriptions
    """
    from bakery.evaluate import smiles
    from bakery.heads.file import load_head

    model = load_head(head)
    seen = {
        folder: [smile for _, smile in smiles.people(folder, model, detector)] for folder in folders
    }
    click.echo(smiles.header())
    for folder, found in seen.items():
        for title, row in smiles.percentiles(found):
            click.echo(smiles.line(f"{folder.parent.name}/{folder.name}, {title}", row))
    for title, weights in smiles.played():
        click.echo(smiles.line(title, *smiles.shown(model, weights)))


@click.command(cls=options.Command)
@click.argument("bundle", type=click.Path(path_type=Path))
@click.option("--curves", required=True, type=click.Path(path_type=Path), help="Take to play.")
@timecode_base
@click.option("--size", default=512, show_default=True, type=click.IntRange(16, 4096))
@click.option("--frames", metavar="FIRST:LAST", help="Only these frames, counted from 0.")
@click.option("--view", default="front", show_default=True, help="photo, front or YAW,PITCH.")
@click.option("--kind", type=click.Choice([".webm", ".mp4"]), default=".webm", show_default=True)
def animate(bundle, curves, base, size, frames, view, kind):
    """Play a take with BUNDLE, encode it, keep nothing: frames a second, memory."""
    from bakery.evaluate import playing
    from bakery.export.open import open_avatar
    from bakery.formats.livelink import read_take
    from bakery.motion.animate import RenderSettings, parse_frames
    from bakery.show import frame

    first, last = parse_frames(frames)
    settings = RenderSettings(
        view=frame.parse(view=view)["view"], framing="face", size=size, first=first, last=last
    )
    result = playing.measure(open_avatar(bundle), read_take(curves, base), settings, kind)
    click.echo(json.dumps(vars(result)))


@click.command(cls=options.Command)
@click.argument("performers", type=click.Path(path_type=Path))
@click.option(
    "--network", type=click.Path(path_type=Path, dir_okay=False),
    help="Weights of `train transfer-export`; the built-in ones otherwise.",
)  # fmt: skip
@click.option(
    "--expressions", default=8, show_default=True, type=click.IntRange(1), help="A pair of people."
)
@click.option("--pictures", type=click.Path(path_type=Path), help="Folder of a sheet a pair.")
@options.overwrite
def transfer(performers, network, expressions, pictures, overwrite):
    """Expressions carried from one painted person to the next, beside direct delta transfer.

    PERFORMERS is a folder of `bakery synth performers` with a seed that nothing was trained on. Their
    textures lie on the painter's own geometry, with a fit's usual mistakes: kinder than a tracked
    clip.
    """
    options.may_fill(pictures, overwrite)
    from bakery.evaluate import transferring
    from bakery.generators import transfer as transfers

    trained, rows = transfers.load(network or transfers.WEIGHTS), []
    if pictures:
        pictures.mkdir(parents=True, exist_ok=True)
    for name, scores in transferring.measure(performers, trained, expressions, pictures):
        click.echo(json.dumps({"name": name} | {way: vars(one) for way, one in scores.items()}))
        rows.append(scores)
    click.echo(json.dumps(transferring.summary(rows)))


@click.command(cls=options.Command)
@click.argument("folder", type=click.Path(path_type=Path))
@click.option("--people", default=4, show_default=True, type=click.IntRange(2))
@click.option("--frames", default=60, show_default=True, type=click.IntRange(12))
@click.option(
    "--seed", default=900, show_default=True, type=click.IntRange(0), help="Of the first person."
)
@click.option("--pictures", type=click.Path(path_type=Path), help="Folder of a sheet a pair.")
@options.head
@options.overwrite
def perform(folder, people, frames, seed, pictures, head, overwrite):
    """Each painted person drives the next one's portrait: avatar, transfer and network beside the truth.

    FOLDER takes clips, portraits and bundles. The clip is tracked and the portrait fitted as for a
    user; a pair takes about four minutes. In the picture: dB of mouth and face, identity by its cosine, frames a
    second; in texture space: `transfer` beside direct delta transfer, as in table 1 of the paper. Then
    faces put into the clips: step and flicker of the seam over the footage's own, dB inside where a
    face stands in its own clip, and seconds of a cut of 60 frames.
    """
    options.may_fill(folder, overwrite)
    options.may_fill(pictures, overwrite)
    from bakery.evaluate import performing, replacing
    from bakery.heads.file import load_head
    from bakery.perform.patch import patch_of
    from bakery.plugins import plug_in

    model, detector, rows = load_head(head), plug_in("detectors", "network"), []
    if pictures:
        pictures.mkdir(parents=True, exist_ok=True)
    for name, *found in performing.run(model, detector, seed, people, frames, folder, pictures):
        ways = [{way: vars(one) for way, one in kind.items()} for kind in found]
        click.echo(json.dumps({"name": name, "shown": ways[0], "textures": ways[1]}))
        rows.append(found)
    click.echo(json.dumps(performing.summary(rows)))
    for name, seam in replacing.run(model, detector, seed, people, folder):
        click.echo(json.dumps({"name": name, "replaced": vars(seam)}))
    click.echo(json.dumps({"cut_seconds": replacing.cut_seconds(patch_of(model))}))
