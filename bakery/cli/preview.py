"""`bakery preview`: an avatar on a page of its own."""

from pathlib import Path

import click

from bakery.cli import options


@click.command(cls=options.Command)
@click.argument("bundle", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), help="HTML file to write.")
@click.option("--serve", is_flag=True, help="Show it on this machine and reload after a new bake.")
@click.option("--port", type=click.IntRange(0, 65535), default=8480, show_default=True)
def preview(bundle, output, serve, port):
    """Write a page that plays BUNDLE in a browser, from disk and without a network.

    \b
    bakery preview portrait.avatar -o portrait.html
    bakery preview portrait.avatar --serve

    An older page is replaced without asking, for it is made again from the bundle.
    """
    if (output is None) == (not serve):
        raise click.UsageError("give -o FILE.html, or --serve")
    from bakery.formats.files import write_bytes
    from bakery.runtime.page import page
    from bakery.runtime.serve import make_server

    if not serve:
        write_bytes(output, page(bundle, derive=_derived))
        options.say(f"{output}: open it in a browser")
        return
    with make_server(bundle, port, _derived) as server:
        options.say(f"http://{server.server_address[0]}:{server.server_address[1]}/ (Ctrl-C ends)")
        server.serve_forever()


def _derived(bundle):
    """The files of web/, for a bundle that was baked before they were complete."""
    from bakery import steps
    from bakery.runtime.web import web_files

    return web_files(steps.open_avatar(bundle))[0]
