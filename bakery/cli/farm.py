"""`bakery farm`: many bakes on other people's engines."""

import shlex
from pathlib import Path

import click
from click.core import ParameterSource

from bakery.cli import options

NAMES = ("preset", "head")  # options of a file, or of what ships
BUILD = (  # the options that every task is given
    "preset", "settings", "head", "generator", "hair", "expressions", "detector", "landmarks",
    "face", "frame", "overwrite", "strict", "keep_photo",
)  # fmt: skip


@click.command(cls=options.Command)
@options.photos
@click.option("-o", "--output", required=True, type=options.PATH, metavar="DIR",
              help="The folder of the bundles.")  # fmt: skip
@click.option("--format", "kind", type=click.Choice(["openjd", "commands", "make"]),
              help="Write a job of this kind: Open Job Description, lines of a shell, a makefile.")  # fmt: skip
@click.option("--to", type=options.PATH, metavar="FILE", help="Write the job there, not to stdout.")
@click.option("--dask", metavar="ADDRESS", help="Bake on this dask cluster, as tcp://host:8786.")
@options.strict
@click.option("--keep-photo", is_flag=True, help="Keep the portraits in the bundles.")
@options.baking
@options.as_json
def farm(photos, output, kind, to, dask, as_json, **given):
    """Bake PHOTOS on a farm. A folder stands for the pictures in it.

    \b
    bakery farm photos/ -o avatars --format openjd --to job.json
    bakery farm photos/ -o avatars --format commands | parallel -j2
    bakery farm photos/ -o avatars --format make > bakes.mk && make -k -j2 -f bakes.mk
    bakery farm photos/ -o avatars --dask tcp://scheduler:8786

    A task is one photo. Tasks may run twice: a fresh bundle is left as it is. Photos and bundles
    are found by their paths, which the machines of the farm must share.
    """
    if (kind is None) == (dask is None):
        raise click.UsageError("give --format for a job file, or --dask for a running cluster")
    if dask and to:
        raise click.UsageError("--dask bakes and writes no job; leave out --to")
    if kind and as_json:
        raise click.UsageError("--json tells of bakes; a job file bakes nothing")
    options.may_go_on(output)
    options.may_write(to, given["overwrite"])
    from bakery.bake import batch

    places = batch.places(batch.portraits(photos), output)
    preset, settings = given.pop("preset"), given.pop("settings")
    chosen = options.build_options(preset, settings)
    if dask:
        _on_cluster(dask, places, chosen, as_json, given)
        return
    from bakery.bake.estimate import estimate
    from bakery.farm import jobs

    arguments = _arguments(click.get_current_context())
    where = Path() if to is None else to.parent
    job = jobs.of_places(places, arguments, estimate(chosen).gibibytes, where)
    options.write(to, jobs.FORMATS[kind](job).encode())
    options.wrote(to)
    if kind == "openjd" and (given := jobs.parameters(job)):
        words = " ".join(f"-p {shlex.quote(f'{name}={path}')}" for name, path in given.items())
        options.say(f"submit it with {words}")


def _arguments(context):
    """The options of `build` that were given, as words of its command line, with whole paths."""
    words, known = [], {option.name: option for option in context.command.params}
    for option in (known[name] for name in BUILD):
        value = context.params[option.name]
        if value in (None, False, ()):
            continue
        default = context.get_parameter_source(option.name) is ParameterSource.DEFAULT
        if default and not option.multiple:  # --set holds what its short forms stand for
            continue
        word = option.opts[-1]
        if option.is_flag:
            words.append(word)
            continue
        for one in value if option.multiple else [value]:
            if isinstance(one, Path) or (option.name in NAMES and Path(one).is_file()):
                one = Path(one).absolute()
            words.append(f"{word}={one}")
    return words


def _on_cluster(address, places, chosen, as_json, given):
    from bakery.bake import batch, pipeline
    from bakery.cli.outcomes import tell
    from bakery.farm.cluster import bake_on

    common = pipeline.Request(*places[0], options=chosen, **given)
    asked = batch.requests_of(places, common)
    with options.progress("") as progress:
        folder = places[0][1].parent
        tell(bake_on(address, asked), [], len(asked), as_json, folder, progress)
