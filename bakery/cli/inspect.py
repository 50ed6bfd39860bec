"""`bakery inspect` and `bakery validate`: what a bundle holds, and whether it is whole."""

import json
from pathlib import Path

import click

from bakery.cli import options
from bakery.errors import BundleError, InputError

bundle = click.argument("bundle", type=click.Path(path_type=Path))


@click.command(cls=options.Command)
@bundle
@options.as_json
def inspect(bundle, as_json):
    """Say what BUNDLE holds; of a single file, the mark that it carries.

    A mark says that a picture, mesh, film or page is synthetic, by which program, and from which
    portrait: by the SHA-256 of its file. A file without one says `none`.

    \b
    bakery inspect portrait.avatar
    bakery inspect portrait.avatar --json | jq .warnings
    bakery inspect laugh.png
    """
    from bakery.export.bundle import read_manifest, summary
    from bakery.formats.ingredient import read_ingredient
    from bakery.formats.mark import found

    if bundle.is_file():
        mark, own = found(bundle), read_ingredient(bundle)
        stored = own is not None and own.store
        by = f"by {own.claimed_by}" if own and own.claimed_by else "that cannot be read"
        table = {
            "file": bundle.name,
            "source type": mark.source_type if mark else (own and own.source_type) or "none",
            "made by": mark.tool if mark else "",
            "made from": mark.photo if mark else "",
            "c2pa": f"a manifest {by}; `bakery verify` checks it" if stored else "",
        }
        if as_json:
            click.echo(json.dumps(table, indent=2))
            return
        for name, value in table.items():
            if value:
                click.echo(f"{name:<12}{value}")
        return
    manifest = read_manifest(bundle)
    if as_json:
        click.echo(json.dumps(summary(bundle, manifest), indent=2))
        return
    for name, value in summary(bundle, manifest).items():
        if isinstance(value, dict):
            value = ", ".join(f"{key} {item}" for key, item in value.items())
        elif isinstance(value, list):
            value = ", ".join(map(str, value)) or "none"
        click.echo(f"{name:<12}{value}")


@click.command(cls=options.Command)
@bundle
@options.as_json
def validate(bundle, as_json):
    """Check BUNDLE; list what is wrong with it and exit with 1.

    Notes tell what a newer bakery has put into it that this one leaves alone.

    \b
    bakery validate portrait.avatar
    """
    from bakery.export.validate import examine

    if bundle.is_file():
        raise InputError(
            f"{bundle}: is a file, and bundles are folders; give one, or ask `bakery inspect` about the file"
        )
    report = examine(bundle)
    found, notes = report.problems, report.notes
    if as_json:
        table = {"bundle": str(bundle), "valid": not found, "problems": found, "notes": notes}
        click.echo(json.dumps(table))
    else:
        for line in [*found, *(f"note: {line}" for line in notes)]:
            click.echo("".join(c if c.isprintable() else repr(c)[1:-1] for c in line))
    if found:
        raise BundleError(f"{bundle}: {len(found)} problem(s); make the bundle again")
    options.say(f"{bundle}: no problems")
