"""`bakery perform`: a performer drives a portrait."""

from pathlib import Path

import click

from bakery.cli import options
from bakery.cli.animate import codec as codec_option
from bakery.cli.animate import gain, neutral

PLAN = {
    "follow": (3, None),
    "fit": (1, None),
    "animate": (3, None),
}  # about how their times compare


@click.command(cls=options.Command, resumes=True)
@click.argument("source", metavar="PORTRAIT|BUNDLE", type=click.Path(path_type=Path))
@click.argument("clip", type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", required=True, type=click.Path(path_type=Path),
    help="Video to write, .mp4 or .webm.",
)  # fmt: skip
@click.option(
    "--by", type=click.Choice(["avatar", "transfer", "network"]), default="avatar", show_default=True,
    help="What paints the face: avatar, its baked textures; transfer, each frame of the clip, whose "
    "expression is carried over to the portrait's skin and mouth; network, the generator's own "
    "picture of each frame.",
)  # fmt: skip
@click.option(
    "--over", metavar="portrait|CLIP2",
    help="Put the face into the portrait (a bundle needs --keep-photo for it), or into other footage, "
    "in place of the face there; CLIP itself is other footage too.",
)  # fmt: skip
@click.option(
    "--over-face", type=click.IntRange(1), metavar="N", help="Which face of CLIP2, as --face."
)
@click.option(
    "--view", default="front", show_default=True, help="front or YAW,PITCH, without --over."
)
@options.framing
@click.option(
    "--size", type=click.IntRange(16, 4096),
    help="Pixels of the longer side; even (512; over CLIP2 that of CLIP2).",
)  # fmt: skip
@click.option("--frames", metavar="FIRST:LAST", help="Only these frames of the clip, from 0.")
@click.option(
    "--face", type=click.IntRange(1), metavar="N",
    help="Which face of the clip, 1 the largest; of several, one that stands out is taken without.",
)  # fmt: skip
@click.option(
    "--rate", type=click.FloatRange(1, 1000), metavar="FPS", help="Frames a second of a folder."
)
@click.option(
    "--fits", type=click.Path(path_type=Path), metavar="DIR",
    help="Keep what was fitted to the clip here, and take it from here when it is there.",
)  # fmt: skip
@click.option("--sound/--no-sound", default=True, show_default=True, help="Keep the clip's sound.")
@click.option("--hair/--no-hair", default=True, show_default=True, help="Show the avatar's hair.")
@options.detector
@options.head
@gain
@neutral
@codec_option
@options.settings_of("track")
@click.option("--work", type=click.Path(path_type=Path), help="Folder for finished parts, kept.")
@options.overwrite
def perform(
    source, clip, output, by, over, over_face, view, framing, size, frames, hair, codec, settings, work, overwrite, **wanted
):  # fmt: skip
    """Play what the person in CLIP does with the person of a portrait or a bundle. An interrupted
    run goes on where it stopped.

    \b
    bakery perform portrait.jpg clip.mp4 -o out.mp4
    bakery perform portrait.avatar clip.mp4 -o out.mp4 --over portrait
    bakery perform portrait.avatar clip.mp4 -o out.mp4 --over other.mp4 --size 1080
    bakery perform portrait.avatar clip.mp4 -o out.mp4 --fits fits/

    Both people have to agree. Each shot of the clip is fitted anew; frames in which the face is
    hidden or blurred lie between their neighbours, and are told. What is written says in its
    metadata that it shows synthetic media.

    Over other footage the film has its rate, and hair, hands and glasses stay before the face; it
    ends with the shorter one. A folder of frames needs --rate, which is then that of both.
    """
    from bakery.errors import UsageProblem
    from bakery.formats.video import codec_of, kind_of

    codec_of(kind_of(output), codec)
    options.may_write(output, overwrite)
    options.may_go_on(work, marks=("lock", "*.key"))
    options.may_go_on(wanted["fits"], marks=("clip.npz",))
    from bakery.formats import pyav
    from bakery.motion.animate import RenderSettings, parse_frames
    from bakery.perform import files
    from bakery.show import frame

    if over not in (None, "portrait"):
        over = Path(over)
    elif over_face:
        raise UsageProblem("--over-face: names a face of --over CLIP2; give that too, or drop it")
    first, last = parse_frames(frames)
    chosen = RenderSettings(
        view=frame.parse(view=view)["view"],
        framing=framing,
        size=size or 512,
        first=first,
        last=last,
        hair=hair,
        codec=codec,
    )
    track = options.options_of("track", settings)
    asked = files.Wanted(
        by, over, over_face, chosen, size is not None, track=track, overwrite=overwrite, **wanted
    )  # fmt: skip
    options.say(files.CONSENT)
    with options.progress(output.name, PLAN) as progress:
        made = files.perform(source, clip, output, asked, progress, work)
    for note in made.notes:
        options.say(f"{clip}: {note}")
    if output.suffix.lower() == ".mp4" and not pyav.available():
        options.say(f"{output}: {pyav.MISSING}")
    options.say(f"wrote {output}: {made.frames} frames, {made.frames / made.rate:.1f} s")
