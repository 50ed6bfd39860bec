"""Options that several commands share, and how they talk: stdout for data, stderr for the rest."""

import contextlib
import logging
import sys
from pathlib import Path

import click

from bakery.errors import InputError

photo = click.argument("photo", type=click.Path(path_type=Path))
photos = click.argument("photos", nargs=-1, required=True, type=click.Path(path_type=Path))
overwrite = click.option("--overwrite", is_flag=True, help="Replace what is already there.")
dry_run = click.option(
    "-n", "--dry-run", is_flag=True, help="Check the input and say what would be done."
)
as_json = click.option("--json", "as_json", is_flag=True, help="Write JSON for other programs.")
head = click.option(
    "--head", default="makehuman", show_default=True, help="Head model: name or file."
)
face = click.option(
    "--face", type=click.IntRange(1), help="Which face, as `detect` counts, from 1."
)
landmarks = click.option(
    "--landmarks",
    type=click.Path(path_type=Path),
    help="Take the landmarks from what `bakery detect` wrote (file, or folder of NAME.json).",
)
preset = click.option(
    "--preset", default="default", show_default=True, help="Preset: name or TOML file."
)
settings = click.option(
    "--set", "settings", multiple=True, metavar="TABLE.KEY=VALUE", help="Change a preset."
)
generator = click.option(
    "--generator", default="pagan", show_default=True, help="What paints expressions."
)
frame = click.option(
    "--frame",
    type=click.IntRange(0),
    is_flag=False,
    flag_value=0,
    help="Take this frame of an animated picture, from 0; without a number the first.",
)


def which_face(command):
    """The options --landmarks, --face and --frame: which face of which picture of a file."""
    return landmarks(face(frame(command)))


def chosen(command):
    """The options --preset and --set."""
    return preset(settings(command))


detector = click.option(
    "--detector", default="network", show_default=True, help="What finds landmarks."
)
resolution = click.option(
    "--resolution", type=click.IntRange(512, 4096), help="Texels on a side (1024)."
)
fitted = click.option(
    "--fit", "fitted", required=True, type=click.Path(path_type=Path), help="From `fit`."
)


def baking(command):
    """The options that `build` and every single step take, so that one call can be made of parts."""
    for option in (
        overwrite, which_face, detector, generator, head, resolution, settings, preset,
    ):  # fmt: skip
        command = option(command)
    return command


class Command(click.Command):
    """A command with -v and -q, and a --frame that needs no number."""

    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        for letter, name, about in (
            ("-v", "--verbose", "Say more."),
            ("-q", "--quiet", "Say less."),
        ):
            self.params.append(
                click.Option(
                    [letter, name], count=True, expose_value=False, callback=_louder, help=about
                )
            )

    def parse_args(self, context, arguments):
        return super().parse_args(context, list(_plain_frames(arguments)))

    def invoke(self, context):
        _start_log(verbosity(context))
        return super().invoke(context)


def _plain_frames(arguments):
    """`--frame PHOTO` means `--frame=0 PHOTO`; `--frame 3 PHOTO` means `--frame=3 PHOTO`."""
    arguments = list(arguments)
    while arguments:
        word = arguments.pop(0)
        if word == "--":
            yield from [word, *arguments]
            return
        if word == "--frame":
            word = f"--frame={arguments.pop(0) if arguments and arguments[0].isdigit() else 0}"
        yield word


def _louder(context, parameter, count):
    if count:
        shared = context.find_root().ensure_object(dict)
        step = count if parameter.name == "verbose" else -count
        shared["verbosity"] = shared.get("verbosity", 0) + step


def verbosity(context=None):
    """-1 and below: errors only; 0: warnings and progress; 1: what happens; 2: everything."""
    context = context or click.get_current_context()
    return (context.find_root().obj or {}).get("verbosity", 0)


def _start_log(level):
    logging.basicConfig(
        stream=sys.stderr,
        format="%(levelname)s %(name)s: %(message)s" if level > 1 else "%(message)s",
        level={-1: logging.ERROR, 0: logging.WARNING, 1: logging.INFO}.get(
            max(level, -1), logging.DEBUG
        ),
        force=True,
    )
    if level < 2:
        for name in ("numba", "PIL", "matplotlib"):
            logging.getLogger(name).setLevel(logging.WARNING)


def say(text):
    """A line for the person at the terminal, on stderr; silent with -q."""
    if verbosity() >= 0:
        click.echo(text, err=True)


def build_options(preset, settings, resolution=None):
    """BuildOptions of a preset, with --set and --resolution on top."""
    from bakery import preset as presets
    from bakery.bake.options import BuildOptions

    tables = presets.with_settings(presets.load("builds", preset), settings)
    if resolution:
        tables.setdefault("texture", {})["resolution"] = resolution
    return presets.options_from(BuildOptions, tables, f"preset {preset}")


def destinations(photos, output, ending=".json"):
    """Where the result of each photo goes.

    Args:
        output: a file (ends in `ending`, or is "-" for stdout), else a folder.

    Returns:
        [(photo, path or None for stdout)].

    Raises:
        click.UsageError: several photos into one file.
        InputError: two photos whose results would get the same name.
    """
    one_file = str(output) == "-" or (output.suffix.lower() == ending and not output.is_dir())
    if one_file and len(photos) > 1:
        raise click.UsageError(f"several photos need a folder to write to, not '{output}'")
    if one_file:
        return [(photos[0], None if str(output) == "-" else output)]
    places, taken = [], {}
    for path in photos:
        place = output / (path.stem + ending)
        if place in taken:
            raise InputError(
                f"{path} and {taken[place]}: both would be written to {place}; use two folders"
            )
        taken[place] = path
        places.append((path, place))
    return places


def may_write(path, overwrite):
    """Refuse to replace a file unless asked to."""
    if path is not None and path.exists() and not overwrite:
        raise InputError(f"{path}: is already there; --overwrite replaces it")


def write(path, data):
    """Write bytes to a path, or to stdout if it is None."""
    from bakery.formats.files import write_bytes

    if path is None:
        click.get_binary_stream("stdout").write(data)
    else:
        write_bytes(path, data)


@contextlib.contextmanager
def progress():
    """A function (step, done, total) that draws a bar on a terminal and nothing elsewhere."""
    if verbosity() < 0 or not sys.stderr.isatty():
        yield lambda step, done, total: None
        return
    width = 30

    def draw(step, done, total):
        filled = width * done // max(total, 1)
        bar = "#" * filled + "." * (width - filled)
        sys.stderr.write(f"\r\x1b[K{step:<10} [{bar}] {done}/{total}")
        sys.stderr.flush()

    try:
        yield draw
    finally:
        sys.stderr.write("\r\x1b[K")
        sys.stderr.flush()
