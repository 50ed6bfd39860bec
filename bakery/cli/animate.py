"""`bakery animate` and `bakery retarget`: takes played, takes changed."""

from pathlib import Path

import click

from bakery.cli import complete, options

gain = click.option(
    "--gain", multiple=True, metavar="[NAME=]FACTOR", shell_complete=complete.gains,
    help="Strength of all expressions, or of one; head=0.5 and gaze=0.5 for angles.",
)  # fmt: skip
neutral = click.option(
    "--neutral", type=click.IntRange(0), metavar="FRAME",
    help="Row of the take, from 0, at which the face rests; its pose is subtracted from all.",
)  # fmt: skip
timecode_base = click.option(
    "--timecode-base", "base", type=click.IntRange(1, 240), metavar="N",
    help="Frames that a second of the take's time code has (60, or what its rows show).",
)  # fmt: skip

codec = click.option(
    "--codec", type=click.Choice(["usual", "av1"]), default="usual", show_default=True,
    help="av1 makes a .mp4 smaller, by bakery[video]; browsers play it, and Apple's devices from 2023 on.",
)  # fmt: skip


@click.command(cls=options.Command, resumes=True)
@click.argument("bundle", type=click.Path(path_type=Path))
@click.option(
    "--curves", required=True, type=click.Path(path_type=Path), help="Live Link Face CSV."
)
@click.option(
    "-o", "--output", required=True,
    help="Video to write, .webm (plays in browsers), .mp4 (players and editors; with bakery[video] "
    "everywhere) or .mov (ProRes 4444 with alpha, by bakery[video]); or PNG frames with alpha: a folder, or a pattern such as out/frame.%05d.png.",
)  # fmt: skip
@click.option(
    "--view", default="front", show_default=True,
    help="photo (of a bundle built with --keep-photo), front or YAW,PITCH.",
)  # fmt: skip
@options.framing
@click.option(
    "--size", default=512, show_default=True, type=click.IntRange(16, 4096),
    help="Pixels of the longer side; even for videos.",
)  # fmt: skip
@click.option(
    "--frames", metavar="FIRST:LAST", help="Only these frames of the take, counted from 0."
)
@click.option(
    "--fps", type=click.FloatRange(1, 240),
    help="Frames a second (the take's own); the take keeps its time.",
)  # fmt: skip
@timecode_base
@click.option("--sound", type=click.Path(path_type=Path), help="Clip whose sound is laid under it.")
@gain
@neutral
@codec
@click.option(
    "--textures", type=click.Choice(["dynamic", "static"]), default="dynamic", show_default=True,
    help="Blend the baked expressions, or show the neutral texture alone.",
)  # fmt: skip
@click.option("--hair/--no-hair", default=True, show_default=True, help="Show the hair.")
@click.option("--work", type=click.Path(path_type=Path), help="Folder for finished parts, kept.")
@options.overwrite
def animate(
    bundle, curves, output, view, framing, size, frames, fps, base, sound, gain, neutral, codec, textures,
    hair, work, overwrite,
):  # fmt: skip
    """Play a take with BUNDLE into a video or into pictures. An interrupted run goes on where it
    stopped.

    \b
    bakery animate portrait.avatar --curves take.csv -o out.webm
    bakery animate portrait.avatar --curves take.csv -o out.mp4 --sound clip.mov --view 20,0
    bakery animate portrait.avatar --curves take.csv -o frames/ --size 1080 --fps 24

    A frame has the number that it has in the whole take. What is written says in its metadata
    that it shows synthetic media.
    """
    from bakery.formats.sequence import check_output

    sequence = check_output(output)
    for place in (sequence.found() or [sequence.path(0)]) if sequence else [Path(output)]:
        options.may_write(place, overwrite)
    output = sequence or Path(output)
    options.may_go_on(work, marks=("lock", "*.key"))
    from bakery.formats import pyav, video
    from bakery.motion import files
    from bakery.motion.animate import RenderSettings, parse_frames
    from bakery.show import frame

    if sequence is None:
        video.codec_of(video.kind_of(output), codec)  # what cannot be had is told at once
    elif codec != "usual":
        raise click.UsageError(f"--codec {codec}: PNG frames have none")
    first, last = parse_frames(frames)
    settings = RenderSettings(
        view=frame.parse(view=view)["view"], framing=framing, size=size, rate=fps, first=first,
        last=last, dynamic=textures == "dynamic", hair=hair, film=sequence is None, codec=codec,
    )  # fmt: skip
    with options.progress(Path(str(output)).name) as progress:
        take, made = files.animate(
            bundle, curves, output, settings, gain, neutral, sound, progress, work, base
        )
    for note in take.notes:
        options.say(f"{curves}: {note}")
    if sequence is None and output.suffix.lower() == ".mp4" and not pyav.available():
        options.say(f"{output}: {pyav.MISSING}")
    options.say(f"wrote {output}: {made.count} frames, {made.count / made.rate:.1f} s")


@click.command(cls=options.Command)
@click.argument("curves", type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", required=True, type=click.Path(path_type=Path), help="CSV to write."
)
@timecode_base
@gain
@neutral
@options.overwrite
def retarget(curves, output, base, gain, neutral, overwrite):
    """Change a take: its resting face subtracted, its weights scaled.

    \b
    bakery retarget take.csv -o mine.csv --neutral 0 --gain 1.2 --gain jawOpen=0.8,head=0.5
    """
    from bakery.motion import files

    options.may_write(output, overwrite)
    take = files.retargeted(curves, gain, neutral, base)
    options.write(output, files.format_take(take))
    for note in take.notes:
        options.say(f"{curves}: {note}")
    options.wrote(output)
