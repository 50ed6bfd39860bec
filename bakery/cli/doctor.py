"""`bakery doctor`: does everything that a bake needs work here?"""

import json

import click

from bakery.cli import options
from bakery.errors import ModelError


@click.command(cls=options.Command)
@click.option("--licences", is_flag=True, help="List the licence of every package that is used.")
@click.option(
    "--warm", is_flag=True,
    help="Compile what the first bake would compile: it takes as long as the next then.",
)  # fmt: skip
@options.as_json
def doctor(licences, warm, as_json):
    """Check this installation and say what is wrong with it.

    \b
    bakery doctor
    bakery doctor --warm
    bakery doctor --licences
    """
    from bakery.bake.doctor import findings

    if licences:
        return _list_licences(as_json)
    if warm:
        from bakery.bake.warm import warm as compile_all

        options.say(f"ready: {compile_all():.0f} s")
        return
    found = findings()
    if as_json:
        click.echo(json.dumps([vars(finding) for finding in found], indent=2))
    else:
        for finding in found:
            mark = "ok  " if finding.good else "FAIL"
            click.echo(f"{mark} {finding.name:<22} {finding.what}")
    bad = [finding.name for finding in found if not finding.good]
    if bad:
        raise ModelError(f"{len(bad)} check(s) failed: {', '.join(bad)}; install bakery again")


def _list_licences(as_json):
    from bakery.bake.licences import licences

    found = licences()
    if as_json:
        click.echo(json.dumps([vars(each) for each in found], indent=2))
        return
    for each in found:
        click.echo(f"{each.package:<32} {each.version:<16} {each.licence}")
