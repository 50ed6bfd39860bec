"""`bakery animate` and `bakery retarget`: takes played, takes changed."""

from pathlib import Path

import click

from bakery.cli import options

gain = click.option(
    "--gain", multiple=True, metavar="[NAME=]FACTOR",
    help="Strength of all expressions, or of one; head=0.5 and gaze=0.5 for angles.",
)  # fmt: skip
neutral = click.option(
    "--neutral", type=click.IntRange(0), metavar="FRAME",
    help="Row of the take, from 0, at which the face rests; its pose is taken off all.",
)  # fmt: skip


@click.command(cls=options.Command, resumes=True)
@click.argument("bundle", type=click.Path(path_type=Path))
@click.option(
    "--curves", required=True, type=click.Path(path_type=Path), help="Live Link Face CSV."
)
@click.option(
    "-o", "--output", required=True, type=click.Path(path_type=Path),
    help="Video to write: .webm (plays in browsers) or .mp4 (players and editors).",
)  # fmt: skip
@click.option("--view", default="front", show_default=True, help="photo, front or YAW,PITCH.")
@click.option("--size", default=512, show_default=True, type=click.IntRange(16, 4096))
@click.option("--frames", metavar="FIRST:LAST", help="Only these frames, counted from 0.")
@click.option("--fps", type=click.FloatRange(1, 240), help="Frames a second (the take's own).")
@click.option("--sound", type=click.Path(path_type=Path), help="Clip whose sound is laid under it.")
@gain
@neutral
@click.option(
    "--textures", type=click.Choice(["dynamic", "static"]), default="dynamic", show_default=True,
    help="Blend the baked expressions, or show the neutral texture alone.",
)  # fmt: skip
@click.option("--hair/--no-hair", default=True, show_default=True, help="Show the hair layer.")
@click.option("--work", type=click.Path(path_type=Path), help="Folder for finished parts, kept.")
@options.overwrite
def animate(
    bundle, curves, output, view, size, frames, fps, sound, gain, neutral, textures, hair, work,
    overwrite,
):  # fmt: skip
    """Play a take with BUNDLE into a video. An interrupted run goes on where it stopped.

    \b
    bakery animate portrait.avatar --curves take.csv -o out.webm
    bakery animate portrait.avatar --curves take.csv -o out.mp4 --sound clip.mov --view 20,0

    The video says in its metadata that it shows synthetic media.
    """
    from bakery.formats.video import kind_of

    options.may_write(output, overwrite)
    options.may_go_on(work, marks=("lock", "*.key"))
    kind_of(output)
    from bakery.motion import files as movies
    from bakery.motion.animate import Show, parse_frames
    from bakery.show import frame as scenes

    first, last = parse_frames(frames)
    show = Show(
        view=scenes.parse(view=view)["view"], size=size, rate=fps, first=first, last=last,
        dynamic=textures == "dynamic", hair=hair,
    )  # fmt: skip
    with options.progress(output.name) as progress:
        take, made = movies.animate(
            bundle, curves, output, show, gain, neutral, sound, progress, work
        )
    for note in take.notes:
        options.say(f"{curves}: {note}")
    options.say(f"{output}: {made.count} frames, {made.count / made.rate:.1f} s")


@click.command(cls=options.Command)
@click.argument("curves", type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", required=True, type=click.Path(path_type=Path), help="CSV to write."
)
@gain
@neutral
@options.overwrite
def retarget(curves, output, gain, neutral, overwrite):
    """Change a take: its resting face taken off, its strength raised or lowered.

    \b
    bakery retarget take.csv -o mine.csv --neutral 0 --gain 1.2 --gain jawOpen=0.8,head=0.5
    """
    from bakery.motion import files as movies

    options.may_write(output, overwrite)
    take = movies.retargeted(curves, gain, neutral)
    options.write(output, movies.format_take(take))
    for note in take.notes:
        options.say(f"{curves}: {note}")
    options.wrote(output)
