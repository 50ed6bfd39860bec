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
@click.option(
    "--livelink", type=click.IntRange(0, 65535), metavar="PORT",
    help="With --serve: play what Live Link Face sends by UDP to this port.",
)  # fmt: skip
@click.option(
    "--listen", default="127.0.0.1", show_default=True, metavar="ADDRESS",
    help="Address of this machine that takes the packets; 0.0.0.0 for those of a phone.",
)  # fmt: skip
@options.overwrite
def preview(bundle, output, module, serve, port, livelink, listen, overwrite):
    """Write a page that plays BUNDLE in a browser, from disk and without a network.

    \b
    bakery preview portrait.avatar -o portrait.html
    bakery preview portrait.avatar --serve
    bakery preview portrait.avatar --module site
    bakery preview portrait.avatar --serve --livelink 11111 --listen 0.0.0.0
    """
    if [output is not None, module is not None, serve].count(True) != 1:
        raise click.UsageError("give one of -o FILE.html, --module FOLDER and --serve")
    if livelink is not None and not serve:
        raise click.UsageError("--livelink needs --serve")
    options.may_write(output, overwrite)
    options.may_fill(module, overwrite)
    from bakery.formats.files import write_bytes
    from bakery.show.live import Live
    from bakery.show.page import page, site
    from bakery.show.serve import make_server

    if output:
        write_bytes(output, page(bundle, derive=_derived))
        options.say(f"wrote {output}: open it in a browser")
        return
    if module:
        for name, data in site(bundle, derive=_derived).items():
            write_bytes(module / name, data)
        options.say(
            f"wrote {module}: put it on a web server; {module / 'index.html'} shows how to use it"
        )
        return
    with contextlib.ExitStack() as open_ones:
        live = None
        if livelink is not None:
            live = open_ones.enter_context(Live(listen, livelink))
            options.say(f"Live Link Face: {live.address[0]}, port {live.address[1]} (UDP)")
        server = open_ones.enter_context(make_server(bundle, port, _derived, live))
        options.say(f"http://{server.server_address[0]}:{server.server_address[1]}/ (Ctrl-C ends)")
        with contextlib.suppress(KeyboardInterrupt):  # how it is meant to end
            server.serve_forever()


def _derived(bundle):
    """The files of web/, for a bundle that was baked before they were complete."""
    from bakery.export.open import open_avatar
    from bakery.export.web import web_files

    return web_files(open_avatar(bundle))[0]
