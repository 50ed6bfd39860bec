"""Options that several commands share, and how they talk: stdout for data, stderr for the rest."""

import importlib
import logging
import sys
import time
from pathlib import Path

import click

from bakery.cli import complete
from bakery.cli.group import Group, Interrupted
from bakery.cli.places import PICTURES, may_bake, may_fill, may_go_on, may_write
from bakery.cli.progress import progress as shown_progress
from bakery.errors import InputError

__all__ = ["Group", "PICTURES", "may_bake", "may_fill", "may_go_on", "may_write"]
log = logging.getLogger(__name__)
PATH = click.Path(path_type=Path)
SETTINGS = {  # whose settings --set changes -> where its options dataclass is
    "build": "bakery.bake.options:BuildOptions",
    "detector": "bakery.train.detector:DetectorOptions",
    "bank": "bakery.train.detector.bank:BankOptions",
    "identity": "bakery.train.identity:IdentityOptions",
    "pagan": "bakery.train.pagan:PaganOptions",
    "transfer": "bakery.train.transfer:TransferOptions",
    "segment-network": "bakery.train.segment:SegmentTraining",
    "track": "bakery.motion.track:TrackOptions",
}

photo = click.argument("photo", type=PATH)
photos = click.argument("photos", nargs=-1, required=True, type=PATH)
framing = click.option(  # `runtime.framing.FRAMINGS`, whose module is slow to import
    "--framing", type=click.Choice(["head", "face"]), default="head", show_default=True,
    help="What front and YAW,PITCH hold: the whole head from any side, or the face, nearer.",
)  # fmt: skip
overwrite = click.option("--overwrite", is_flag=True, help="Replace what is already there.")
dry_run = click.option(
    "-n", "--dry-run", is_flag=True, help="Check the input and say what would be done."
)
as_json = click.option("--json", "as_json", is_flag=True, help="Write JSON for other programs.")
head = click.option(
    "--head", default="makehuman", show_default=True, shell_complete=complete.heads,
    help="Head model: name or file.",
)  # fmt: skip
face = click.option(
    "--face",
    type=click.IntRange(1),
    metavar="N",
    help="Which face, 1 the largest; of several, one that stands out is taken without.",
)
landmarks = click.option(
    "--landmarks", type=PATH,
    help="Take the landmarks from what `bakery detect` wrote (file, or folder of NAME.json).",
)  # fmt: skip
preset = click.option(
    "--preset", default="default", show_default=True, shell_complete=complete.presets,
    help="Preset: name or TOML file; see `bakery presets`.",
)  # fmt: skip
generator = click.option(
    "--generator", default="pagan", show_default=True,
    shell_complete=complete.plug_ins("generators"), help="What paints expressions.",
)  # fmt: skip
detector = click.option(
    "--detector", default="network", show_default=True,
    shell_complete=complete.plug_ins("detectors"), help="What finds landmarks.",
)  # fmt: skip
hair = click.option(
    "--hair", default="cards", show_default=True, shell_complete=complete.plug_ins("hair"),
    help="What makes hair; none leaves it off.",
)  # fmt: skip


def _sets(key):
    """Arguments of an option that is short for `--set texture.KEY=`, and comes after all of those."""

    def add(context, parameter, value):
        if value is not None and not context.resilient_parsing:
            context.params["settings"] += (f"texture.{key}={value}",)

    return {"expose_value": False, "callback": add}


resolution = click.option(
    "--resolution", type=click.IntRange(512, 4096), help="Texels on a side (1024).",
    **_sets("resolution"),
)  # fmt: skip
neutral = click.option(
    "--neutral", type=click.Choice(["rest", "keep"]), **_sets("neutral"),
    help="Take the photo's expression out of the neutral skin and shape (rest), or keep it.",
)  # fmt: skip
ways = click.Choice(["none", "mirror", "quick", "synthesize"])
completion = click.option(
    "--complete", type=ways, **_sets("complete"),
    help="How to fill in skin that the photo does not show (quick).",
)  # fmt: skip
keep_glasses = click.option(
    "--keep-glasses", flag_value="keep", default=None, **_sets("glasses"),
    help="Bake the frames of glasses as a layer over the skin, in place of taking them off.",
)  # fmt: skip
consent = click.option(
    "--consent", metavar="TEXT|FILE",
    help="What the person shown agreed to; it goes into the manifest, with its SHA-256.",
)  # fmt: skip
sign = click.option(
    "--sign", nargs=2, type=PATH, metavar="CERT KEY",
    help="Sign the bundle and its preview by this certificate and key, files in PEM (extra c2pa).",
)  # fmt: skip
strict = click.option("--strict", is_flag=True, help="Refuse a portrait that gives warnings.")
fitted = click.option("--fit", "fitted", required=True, type=PATH, help="From `fit`.")
weights = click.option(
    "--weights", default="", shell_complete=complete.weights,
    help="Expression: jawOpen=0.6,mouthSmileLeft=0.8; `bakery shapes` lists the names.",
)  # fmt: skip
frame = click.option(
    "--frame",
    type=click.IntRange(0),
    is_flag=False,
    flag_value=0,
    help="Take this frame of an animated picture, from 0; 0 if no number follows.",
)


def settings_of(of):
    """The option --set for one of SETTINGS."""

    def help_(context, parameter, given):
        if "help" in given and not context.resilient_parsing:
            from bakery.preset import as_toml

            click.echo(as_toml(options_class(of)()))
            context.exit()
        return given

    return click.option(
        "--set", "settings", multiple=True, metavar="KEY=VALUE", is_eager=True, callback=help_,
        shell_complete=complete.settings(of), help="Change a setting; `--set help` lists all.",
    )  # fmt: skip


settings = settings_of("build")


def which_face(command):
    """The options --landmarks, --face and --frame: which face of which picture of a file."""
    return landmarks(face(frame(command)))


def chosen(command):
    """The options --preset and --set."""
    return preset(settings(command))


expressions = click.option(
    "--expressions", type=PATH, metavar="FILE",
    help="TOML with key expressions, gazes and mouths to bake in place of those that ship.",
)  # fmt: skip


def baking(command):
    """The options that `build` and every single step take, so that one call can be made of parts."""
    for option in (
        overwrite, which_face, detector, expressions, hair, generator, head, keep_glasses,
        completion, neutral, resolution, settings, preset,
    ):  # fmt: skip
        command = option(command)
    return command


class Command(click.Command):
    """A command with -v and -q, a --frame that needs no number, and no option twice.

    Args:
        resumes: whether it goes on from where it was interrupted when it is called again.
    """

    def __init__(self, *arguments, resumes=False, **options):
        super().__init__(*arguments, **options)
        self.resumes = resumes
        for parameter in self.params:
            if isinstance(parameter.type, click.Path):
                parameter.type.readable = False  # no wrong usage: who reads the file says it
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
        arguments = list(_plain_frames(arguments))
        if not context.resilient_parsing:
            self._refuse_twice(context, arguments)
        return super().parse_args(context, arguments)

    def _refuse_twice(self, context, arguments):
        """Of an option given twice click takes the last without a word."""
        _, _, order = self.make_parser(context).parse_args(args=list(arguments))
        for option in self.params:
            once = isinstance(option, click.Option) and not (
                option.multiple or option.count or option.is_flag
            )
            if once and order.count(option) > 1:
                raise click.UsageError(
                    f"{max(option.opts, key=len)} is given twice; give it once", context
                )

    def invoke(self, context):
        _start_log(verbosity(context))
        start = time.monotonic()
        try:
            return super().invoke(context)
        except KeyboardInterrupt:
            goes_on = "; the same command goes on from what is finished" if self.resumes else ""
            raise Interrupted(f"interrupted{goes_on}") from None
        finally:
            log.info("%s: %.1f s in all", context.info_name, time.monotonic() - start)


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
    style = "%(levelname)s %(name)s: %(message)s" if level > 1 else "%(message)s"
    logging.basicConfig(
        stream=sys.stderr,
        format=_clear() + style,
        level={-1: logging.ERROR, 0: logging.WARNING, 1: logging.INFO}.get(
            max(level, -1), logging.DEBUG
        ),
        force=True,
    )
    if level < 2:
        for name in ("numba", "PIL", "matplotlib"):
            logging.getLogger(name).setLevel(logging.WARNING)


def _clear():
    """What takes a progress bar off the terminal before a line is written."""
    return "\r\x1b[K" if sys.stderr.isatty() else ""


def say(text):
    """A line for the person at the terminal, on stderr; silent with -q."""
    if verbosity() >= 0:
        click.echo(_clear() + text, err=True)


def wrote(*paths):
    """Say where the result is; None is stdout, where it shows itself."""
    for path in paths:
        if path is not None:
            say(f"wrote {path}")


def progress(name="", plan=None):
    """A context with a function (step, done, total); see `cli.progress.Progress`."""
    return shown_progress(verbosity(), name, plan)


def options_class(of):
    """The options dataclass of one of SETTINGS."""
    module, _, name = SETTINGS[of].partition(":")
    return getattr(importlib.import_module(module), name)


def build_options(preset, settings):
    """BuildOptions of a preset, with settings on top.

    Raises:
        UsageProblem: no such preset or setting, or a value that is not allowed.
    """
    from bakery import preset as presets

    tables = presets.with_settings(presets.load("builds", preset), settings)
    return presets.options_from(options_class("build"), tables, f"preset {preset}")


def options_of(of, settings, **given):
    """The options of a training or of `track`: those of `given` that are not None, with --set on top."""
    from bakery import preset as presets

    table = {name: value for name, value in given.items() if value is not None}
    return presets.options_from(options_class(of), presets.with_settings(table, settings), of)


def is_file(output, ending=".json"):
    """Whether a path is meant as one file: it ends so, or is "-" for stdout; else it is a folder."""
    return str(output) == "-" or (output.suffix.lower() == ending and not output.is_dir())


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
    one_file = is_file(output, ending)
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


def write(path, data):
    """Write bytes to a path, or to stdout if it is None."""
    from bakery.formats.files import write_bytes

    if path is None:
        click.get_binary_stream("stdout").write(data)
    else:
        write_bytes(path, data)
