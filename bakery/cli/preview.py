"""`bakery preview`: an avatar on a page of its own."""

import contextlib
from pathlib import Path

import click

from bakery.cli import options


@click.command(cls=options.Command)
@click.argument("bundle", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), help="HTML file to write.")
@click.option(
    "--module", type=click.Path(path_type=Path),
    help="New folder to write the JavaScript module and the bundle to, for a page of your own.",
)  # fmt: skip
@click.option("--serve", is_flag=True, help="Show it on this machine and reload after a new bake.")
@click.option("--port", type=click.IntRange(0, 65535), default=8480, show_default=True)
@options.overwrite
def preview(bundle, output, module, serve, port, overwrite):
    """Write a page that plays BUNDLE in a browser, from disk and without a network.

    \b
    bakery preview portrait.avatar -o portrait.html
    bakery preview portrait.avatar --serve
    bakery preview portrait.avatar --module site
    """
    if [output is not None, module is not None, serve].count(True) != 1:
        raise click.UsageError("give one of -o FILE.html, --module FOLDER and --serve")
    options.may_write(output, overwrite)
    options.may_fill(module, overwrite)
    from bakery.formats.files import write_bytes
    from bakery.show.page import page, site
    from bakery.show.serve import make_server

    if output:
        write_bytes(output, page(bundle, derive=_derived))
        options.say(f"{output}: open it in a browser")
        return
    if module:
        for name, data in site(bundle, derive=_derived).items():
            write_bytes(module / name, data)
        options.say(
            f"{module}: put it on a web server; {module / 'index.html'} shows how to use it"
        )
        return
    with make_server(bundle, port, _derived) as server:
        options.say(f"http://{server.server_address[0]}:{server.server_address[1]}/ (Ctrl-C ends)")
        with contextlib.suppress(KeyboardInterrupt):  # how it is meant to end
            server.serve_forever()


def _derived(bundle):
    """The files of web/, for a bundle that was baked before they were complete."""
    from bakery.export.open import open_avatar
    from bakery.export.web import web_files

    return web_files(open_avatar(bundle))[0]
