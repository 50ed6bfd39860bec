"""What becomes of many bakes, told as they are done."""

import click

from bakery.cli import options
from bakery.errors import InputError


def tell(outcomes, made, total, as_json, folder=None, progress=None):
    """Say a line of each bake, then how many there are of each kind; the contact sheet at the end.

    Args:
        outcomes: iterator of bake.batch.Outcome.
        made: list that they are added to.
        total: how many there will be.
        as_json: whether each is a JSON line on stdout too.
        folder: gets a contact sheet of all, as a page; None for none.
        progress: function (step, done, total) told of each, or None.

    Raises:
        InputError: some failed.
    """
    from bakery.bake import batch
    from bakery.show.contact_page import write_contact_page

    for outcome in outcomes:
        made.append(outcome)
        if progress is not None:
            progress("bakes", len(made), total)
        if as_json:
            click.echo(batch.as_json(outcome))
        options.say(f"[{len(made)}/{total}] {outcome.line()}")
    options.say(batch.summary(made))
    if folder is not None and folder.is_dir():
        page = write_contact_page(folder, made)
        if page is not None:
            options.say(f"{page}: look at it")
    failed = sum(outcome.state == "failed" for outcome in made)
    if failed:
        raise InputError(f"{failed} of {total} portraits failed; see above")
