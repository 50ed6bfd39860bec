"""The `bakery` command: what commands there are, and what errors look like.

A command's module is imported when it is called, so that `bakery --help` waits for nobody.
"""

import errno
import importlib
import sys

import click

from bakery import __version__
from bakery.cli.entries import may_have
from bakery.cli.group import Group, Interrupted, help_width
from bakery.errors import BakeryError, ModelError, UsageProblem, lacks_memory

COMMANDS = {  # name -> (module in bakery.cli, what it does), in the order of the bake
    "build": ("build", "Bake a portrait into an avatar bundle."),
    "farm": ("farm", "Bake many portraits on a farm; write its job."),
    "detect": ("detect", "Find faces and their 478 landmarks."),
    "segment": ("segment", "Label the pixels of photos: skin, hair, clothes ..."),
    "fit": ("fit", "Fit the head model to photos."),
    "texture": ("texture", "Paint the textures of one fit."),
    "albedo": ("texture", "Unwrap the skin without light and highlights."),
    "hair": ("hair", "Make the hair of a portrait, alone."),
    "mask": ("texture", "Draw the activation masks of a head model."),
    "bundle": ("bundle", "Pack fit, textures and masks into a bundle."),
    "inspect": ("inspect", "Say what a bundle holds."),
    "validate": ("inspect", "Check a bundle; list what is wrong with it."),
    "sign": ("sign", "Sign a file or a bundle by a certificate."),
    "verify": ("sign", "Check who signed a file or a bundle."),
    "export": ("export", "Write a bundle in another format."),
    "preview": ("preview", "Write a page that plays an avatar in a browser."),
    "render": ("render", "Draw a frame of an avatar."),
    "recover": ("render", "Write the texture of single expressions (eq. 4)."),
    "generate": ("generate", "Paint a portrait with another expression, view and gaze."),
    "track": ("track", "Follow the face in a clip; write a take."),
    "animate": ("animate", "Play a take into a video."),
    "perform": ("perform", "Play a clip of a performer with a portrait."),
    "retarget": ("animate", "Change a take: rest, strength."),
    "shapes": ("shapes", "List the shapes and named expressions."),
    "presets": ("presets", "List presets and all settings."),
    "heads": ("heads", "List, show and import head models."),
    "doctor": ("doctor", "Check this installation."),
    "synth": ("synth", "Paint synthetic portraits."),
    "train": ("train", "Train the networks of the project."),
    "evaluate": ("evaluate", "Measure the project on photographs."),
}

FORMER = {"textures": "texture", "masks": "mask", "pack": "bundle"}  # names until 0.1

DISK = (  # what a disk, or a person's choice of a path, may answer anywhere
    errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES, errno.EPERM, errno.ENAMETOOLONG,
    errno.ENOTDIR, errno.EISDIR, errno.EIO, errno.ELOOP,
)  # fmt: skip


class LazyGroup(Group):
    """A group whose commands are imported when they are called."""

    def list_commands(self, context):
        return [*COMMANDS, *_others()]

    def get_command(self, context, name):
        name = FORMER.get(name, name)
        if name not in COMMANDS:
            return _plugged_in(name)
        module = importlib.import_module(f"bakery.cli.{COMMANDS[name][0]}")
        return getattr(module, name)

    def shell_complete(self, context, incomplete):
        from click.shell_completion import CompletionItem

        about = {name: about for name, (_, about) in COMMANDS.items()} | _about_others()
        return [
            CompletionItem(name, help=about[name]) for name in about if name.startswith(incomplete)
        ] + click.Command.shell_complete(self, context, incomplete)

    def format_commands(self, context, formatter):
        with formatter.section("Commands"):
            formatter.write_dl([(name, about) for name, (_, about) in COMMANDS.items()])
        if others := _about_others():
            with formatter.section("Commands of other packages"):
                formatter.write_dl(list(others.items()))


def _others():
    """Commands that other packages bring: name -> entry point of the group `bakery.commands`."""
    if not may_have("bakery.commands"):
        return {}
    from importlib.metadata import entry_points

    found = {entry.name: entry for entry in entry_points(group="bakery.commands")}
    return {name: found[name] for name in sorted(found) if name not in COMMANDS}


def _about_others():
    """What is said of the commands of other packages: name -> text."""
    return {name: f"See {entry.dist.name}." for name, entry in _others().items()}


def _plugged_in(name):
    """The command of another package, or None."""
    if name not in _others():
        return None
    from bakery.plugins import loaded

    command = loaded("commands", name)
    if not isinstance(command, click.Command):
        raise ModelError(f"command '{name}' is no click.Command; mend or uninstall its package")
    return command


@click.command(
    cls=LazyGroup,
    context_settings={"help_option_names": ["-h", "--help"], "terminal_width": help_width()},
)
@click.version_option(__version__, prog_name="bakery")
@click.option("-v", "--verbose", count=True, help="Say more; twice for everything.")
@click.option("-q", "--quiet", count=True, help="Say less; only errors.")
@click.pass_context
def bakery(context, verbose, quiet):
    """Bake one portrait photograph into an animatable avatar.

    \b
    bakery build portrait.jpg -o portrait.avatar
    """
    context.obj = {"verbosity": verbose - quiet}


def main(arguments=None):
    """Run the command line; errors of the user end in one line and exit code 1, or 2 for usage."""
    try:
        code = bakery.main(arguments, prog_name="bakery", standalone_mode=False)
    except click.UsageError as error:
        error.show()
        code = 2
    except UsageProblem as error:
        code = _one_line(str(error), 2)
    except (BakeryError, click.ClickException) as error:
        code = _one_line(str(error) if isinstance(error, BakeryError) else error.format_message())
    except (Interrupted, click.Abort, KeyboardInterrupt) as error:
        code = _one_line(str(error) or "interrupted", 130)
    except BrokenPipeError:
        sys.stderr.close()  # the reader went away, as `head` does
        code = 1
    except Exception as error:
        if lacks_memory(error):
            code = _one_line("not enough memory; close other programs or lower --resolution")
        elif isinstance(error, OSError) and error.errno in DISK:
            from bakery.formats.files import disk_error

            where = error.filename or "the standard output or a temporary file"
            code = _one_line(str(disk_error(where, error, "cannot be used")))
        else:
            raise
    sys.exit(code if isinstance(code, int) else 0)


def _one_line(message, code=1):
    """Print an error; a line break inside a file name must not make two lines of it."""
    text = "".join(c if c.isprintable() else repr(c)[1:-1] for c in message)
    click.echo(f"bakery: {text}", err=True)
    return code
