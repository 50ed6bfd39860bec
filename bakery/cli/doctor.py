"""`bakery doctor`: does everything that a bake needs work here?"""

import json

import click

from bakery.cli import options
from bakery.errors import ModelError


@click.command(cls=options.Command)
@options.as_json
def doctor(as_json):
    """Check this installation and say what is wrong with it.

    \b
    bakery doctor
    """
    from bakery.bake.doctor import findings

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
