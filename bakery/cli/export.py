"""`bakery export`: a bundle in another format."""

import os
from importlib import import_module

import click

from bakery.cli import complete, options

# What puts a take into files of an ending.
TAKES = {".glb": "bakery.export.glb_take", ".usdz": "bakery.export.usd_take"}


@click.command(cls=options.Command)
@click.argument("bundle", type=options.PATH)
@click.option(
    "--format", "name", required=True, shell_complete=complete.plug_ins("exporters"),
    help="glb, glb-speech (with visemes), glb-lit (for lamps), glb-full (with both), usd, vrm, textures (for renderers), web, exr, head, preview, proxies, or one that a plug-in brings.",
)  # fmt: skip
@click.option("-o", "--output", required=True, type=options.PATH, help="File or folder to write.")
@click.option(
    "--side", type=click.IntRange(64, 4096), default=1024, show_default=True,
    help="Texels on a side of textures, at most.",
)  # fmt: skip
@click.option(
    "--curves", type=options.PATH, help="Take to put into a .glb or .usdz as its animation."
)
@options.overwrite
def export(bundle, name, output, side, curves, overwrite):
    """Write BUNDLE in another format.

    \b
    bakery export portrait.avatar --format glb -o portrait.glb
    bakery export portrait.avatar --format exr -o textures/
    bakery export portrait.avatar --format glb --curves take.csv -o talking.glb
    bakery export portrait.avatar --format usd --curves take.csv -o talking.usdz

    A folder must be new or empty.
    """
    from bakery.export.bundle import read_manifest
    from bakery.export.open import open_avatar
    from bakery.formats.files import write_bytes
    from bakery.formats.livelink import read_take
    from bakery.formats.mark import of_manifest, stamp
    from bakery.formats.place import clean, locked_folder
    from bakery.plugins import plug_in

    exporter = plug_in("exporters", name)
    if curves and exporter.suffix not in TAKES:
        raise click.UsageError(
            f"--curves goes into {' and '.join(TAKES)} files; --format {name} writes none"
        )
    take = read_take(curves) if curves else None
    if exporter.suffix:
        options.may_write(output, overwrite, endings=(exporter.suffix,))
    else:
        options.may_fill(output, overwrite=False)
    avatar = open_avatar(bundle)
    output.parent.mkdir(parents=True, exist_ok=True)
    clean(output)
    with locked_folder(output) as hidden:  # written aside
        made = hidden / "made" / output.name
        made.parent.mkdir()
        exporter.export(avatar, made, side)
        if take:
            with_take = import_module(TAKES[exporter.suffix]).with_take
            write_bytes(made, with_take(made.read_bytes(), take))
        if said := of_manifest(read_manifest(bundle)):
            stamp(made, said)
        if output.is_dir():
            output.rmdir()  # empty: `may_fill` made sure of it
        os.replace(made, output)
    for note in take.notes if take else ():
        options.say(f"{curves}: {note}")
    options.wrote(output)
