"""`bakery track`: a clip of a talking person to a take."""

from pathlib import Path

import click

from bakery.cli import options
from bakery.cli.animate import gain, neutral

PLAN = {"follow": (3, None), "fit": (1, None)}  # about how their times compare


@click.command(cls=options.Command)
@click.argument("clip", type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", required=True, type=click.Path(path_type=Path),
    help="CSV to write, as Live Link Face has it.",
)  # fmt: skip
@click.option(
    "--rate", type=click.FloatRange(1, 1000), metavar="FPS", help="Frames a second of a folder."
)
@click.option(
    "--fits", type=click.Path(path_type=Path), metavar="DIR",
    help="Write identity, cameras, expressions and gazes here, as fitted (two npz files).",
)  # fmt: skip
@options.detector
@options.head
@gain
@neutral
@options.settings_of("track")
@options.overwrite
def track(clip, output, rate, fits, detector, head, gain, neutral, settings, overwrite):
    """Follow the face in CLIP, a video or a folder of numbered PNG or JPEG files, and write what it does.

    \b
    bakery track clip.mp4 -o take.csv
    bakery track frames/ --rate 25 -o take.csv
    bakery animate portrait.avatar --curves take.csv --sound clip.mp4 -o out.mp4

    One person fills the clip; of several faces the largest is followed. Where it cannot be seen for
    a few frames, these lie between their neighbours; in longer gaps it rests. Both are told.
    """
    from bakery.motion import files

    options.may_write(output, overwrite)
    options.may_fill(fits, overwrite)
    chosen = options.options_of("track", settings)
    with options.progress(output.name, PLAN) as progress:
        take = files.tracked(clip, head, gain, neutral, progress, chosen, rate, fits, detector)
    options.write(output, files.format_take(take))
    options.wrote(fits)
    for note in take.notes:
        options.say(f"{clip}: {note}")
    options.say(f"wrote {output}: {len(take.seconds)} frames, {take.rate:g} a second")
