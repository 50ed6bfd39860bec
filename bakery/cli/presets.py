"""`bakery presets`: what presets there are, and every setting with its range."""

import json

import click

from bakery.cli import complete, options


@click.group(cls=options.Group)
def presets():
    """List presets and all settings."""


@presets.command("list", cls=options.Command)
@options.as_json
def list_(as_json):
    """List the presets that --preset knows by name.

    \b
    bakery presets list
    """
    from bakery import preset

    known = {name: preset.about("builds", name) for name in preset.names("builds")}
    if as_json:
        click.echo(json.dumps(known, indent=2))
        return
    for name, about in known.items():
        click.echo(f"{name:10} {about}")


@presets.command(cls=options.Command)
@click.argument("name", default="default", shell_complete=complete.presets)
@options.settings
@options.as_json
def show(name, settings, as_json):
    """Write every setting of the preset NAME (or file), with its range, unit and meaning.

    What is written is a preset itself: save it, change it, give it to --preset.

    \b
    bakery presets show default > mine.toml
    bakery build portrait.jpg --preset mine.toml -o portrait.avatar
    """
    from dataclasses import asdict

    from bakery.preset import as_toml

    chosen = options.build_options(name, settings)
    click.echo(json.dumps(asdict(chosen), indent=2) if as_json else as_toml(chosen))
