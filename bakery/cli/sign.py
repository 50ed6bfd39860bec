"""`bakery sign` and `bakery verify`: C2PA signatures of files and bundles."""

import json

import click

from bakery.cli import options

given = click.argument("given", metavar="FILE|BUNDLE", type=options.PATH)


@click.command(cls=options.Command)
@given
@click.argument("certificate", metavar="CERT", type=options.PATH)
@click.argument("key", metavar="KEY", type=options.PATH)
@click.option(
    "-o", "--output", type=options.PATH, help="Write the signed one there (in its own place)."
)
@options.overwrite
def sign(given, certificate, key, output, overwrite):
    """Sign what bakery wrote: a PNG, JPEG, WebP, MP4 or MOV file in itself, a bundle by a file
    avatar.c2pa beside its manifest. Needs the extra c2pa.

    \b
    bakery sign talking.mp4 chain.pem key.pem
    bakery sign portrait.avatar chain.pem key.pem -o signed.avatar

    CERT holds certificates in PEM, the signer's first; KEY its private key, which is read and kept
    nowhere. Nothing is asked of a network, so no time stamp proves when it was signed: the signature
    holds as long as the certificate does. --overwrite replaces an older signature, or what is at -o.
    """
    from bakery.formats.files import read_bytes
    from bakery.formats.signing import read_credentials, sign_file

    target = output or given
    if given.is_dir():
        if output is not None:
            options.may_bake(output, overwrite)
        from bakery.export.signed import sign_bundle

        sign_bundle(given, target, read_credentials(certificate, key), overwrite)
    else:
        read_bytes(given, 2**50, first=1)  # a missing file is told before its place is looked at
        options.may_write(target, overwrite or output is None, endings=(given.suffix.lower(),))
        sign_file(given, target, read_credentials(certificate, key), overwrite)
    options.wrote(target)


@click.command(cls=options.Command)
@given
@click.option(
    "--trust", type=options.PATH, metavar="ANCHORS",
    help="Certificates in PEM of the authorities that are trusted; others are refused then.",
)  # fmt: skip
@options.as_json
def verify(given, trust, as_json):
    """Check who signed FILE or BUNDLE, and that no byte changed since; else exit with 1. Needs the
    extra c2pa.

    \b
    bakery verify talking.mp4
    bakery verify portrait.avatar --trust authorities.pem

    Without --trust a signature is checked for itself: anybody may have made it in any name.
    """
    from bakery.export.signed import verify_bundle
    from bakery.formats.mark import type_name
    from bakery.formats.signing import check_file, read_anchors

    anchors = read_anchors(trust) if trust else b""
    said = (verify_bundle if given.is_dir() else check_file)(given, anchors)
    table = {
        "file": given.name,
        "signature": "holds",
        "signed by": ", ".join(filter(None, (said.by, said.organisation))),
        "trusted": ("yes" if said.trusted else "no") if trust else "not asked; see --trust",
        "made by": said.generator,
        "source type": ", ".join(map(type_name, said.source_types)),
    }
    if as_json:
        click.echo(json.dumps(table, indent=2))
        return
    for name, value in table.items():
        click.echo(f"{name:<12}{value}")
