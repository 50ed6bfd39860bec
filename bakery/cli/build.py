"""`bakery build`: portraits in, avatar bundles out."""

from pathlib import Path

import click

from bakery.cli import options

BUNDLE = ".avatar"
# Endings of files, which nobody means to be a folder.
OTHERS = (".glb", ".gltf", ".json", ".zip", ".exr", ".npz", ".png", ".jpg", ".jpeg", ".mp4")


@click.command(cls=options.Command, resumes=True)
@options.photos
@click.option(
    "-o", "--output", metavar="PATH",
    help="The bundle's folder; of several photos, or with a / at its end, the folder of the bundles "
    "(beside each photo as NAME.avatar).",
)  # fmt: skip
@options.baking
@click.option(
    "--same-person",
    is_flag=True,
    help="All PHOTOS show one person: one bundle of them (as when -o is a NAME.avatar).",
)
@options.strict
@click.option("--keep-photo", is_flag=True, help="Keep the portrait in the bundle.")
@options.consent
@options.sign
@click.option(
    "--skip-fresh",
    is_flag=True,
    help="Leave a bundle that would come out the same (as always of several photos).",
)
@click.option("--work", type=options.PATH, help="Keep finished steps in this folder.")
@click.option(
    "-j", "--jobs", type=click.IntRange(1, 64), default=1, show_default=True,
    help="Bakes at once; each needs its own memory.",
)  # fmt: skip
@options.as_json
@options.dry_run
def build(
    photos, output, preset, settings, same_person, sign, skip_fresh, jobs, as_json, dry_run, **request
):  # fmt: skip
    """Bake PHOTOS into avatar bundles. A folder stands for the pictures in it.

    \b
    bakery build portrait.jpg
    bakery build portrait.jpg -o ada.avatar --resolution 2048 --set texture.mouths=100
    bakery build photos/*.jpg -o avatars/ --jobs 2
    bakery build ada-front.jpg ada-side.jpg --same-person -o ada.avatar
    bakery build portrait.jpg --sign chain.pem key.pem

    Several photos of one person share identity and warp; the most frontal, neutral and sharp one
    gives the face, the others fill what it sees badly.

    An interrupted bake goes on where it stopped when it is called again. Of several photos, those
    whose bundle is fresh are skipped, and one that fails does not stop the others; index.html in
    their folder shows them all.
    """
    from bakery.formats.image_header import check_file

    many = len(photos) > 1 or photos[0].is_dir()
    if len(photos) > 1 and output is not None and output.endswith(BUNDLE):
        same_person = True
    if same_person and (not many or output is None or output.endswith("/")):
        raise click.UsageError(
            "--same-person makes one bundle of two photos or more; give them, and -o NAME.avatar"
        )
    folder = output is not None and not same_person and (many or output.endswith("/"))
    several = folder or (many and not same_person)
    if not many:
        check_file(photos[0], request["frame"])  # before the slow imports: it is told at once
    elif several and request["work"]:
        raise click.UsageError("--work keeps the steps of one bake; give one photo")
    from bakery.bake import batch, pipeline
    from bakery.bake.estimate import plan
    from bakery.bake.targets import read_targets
    from bakery.export.consent import read_consent
    from bakery.formats.signing import read_credentials

    if output is not None and not folder and Path(output).suffix.lower() in OTHERS:
        raise click.UsageError(
            f"-o {output}: a bundle is a folder; give a name such as portrait.avatar"
        )
    found = batch.portraits(photos)
    if same_person:
        if len(found) < 2:
            raise click.UsageError("--same-person needs two photos or more; give another")
        found, request["others"] = found[:1], tuple(found[1:])
    places = (
        batch.places(found, Path(output) if folder else None)
        if folder or output is None
        else [(found[0], Path(output))]
    )
    chosen = options.build_options(preset, settings)
    if request["consent"] is not None:
        request["consent"] = read_consent(request["consent"])
    if sign:
        request["credentials"] = read_credentials(*sign)
    common = pipeline.Request(*places[0], options=chosen, **request)
    asked = batch.requests_of(places, common)
    if not several:
        if skip_fresh and batch.is_fresh(asked[0]):
            _tell_fresh(batch.fresh(asked[0]), as_json)
            return
        options.may_bake(asked[0].output, asked[0].overwrite)
    options.may_go_on(request["work"], marks=("lock", "*.key"))
    if dry_run:
        if several:
            _describe(asked)
        else:
            click.echo(pipeline.describe(asked[0]))
        return
    steps = plan(chosen, read_targets(common.expressions), common.generator)
    if several:
        _all(asked, jobs, as_json, steps if jobs == 1 else None, Path(output) if folder else None)
        return
    with options.progress(asked[0].output.name, steps) as progress:
        outcome = batch.baked(asked[0], progress)
    if as_json:
        click.echo(batch.as_json(outcome))
    options.say(f"wrote {asked[0].output}: look at {asked[0].output / 'preview.png'}")


def _describe(asked):
    """Say what would become of several photos, as `_all` would bake them.

    Raises:
        InputError: some would fail.
    """
    from bakery.bake import batch, pipeline
    from bakery.errors import BakeryError, InputError

    failed = 0
    for one in asked:
        try:
            fresh = batch.is_fresh(one)
            click.echo(batch.fresh(one).line() if fresh else pipeline.describe(one))
        except BakeryError as error:
            failed += 1
            options.say(f"{one.photo}: would fail: {str(error).removeprefix(f'{one.photo}: ')}")
    if failed:
        raise InputError(f"{failed} of {len(asked)} portraits would fail; see above")


def _tell_fresh(outcome, as_json):
    from bakery.bake import batch

    if as_json:
        click.echo(batch.as_json(outcome))
    options.say(outcome.line())


def _all(asked, jobs, as_json, plan, folder):
    """Bake several photos, a line each; then how many of each kind.

    Args:
        plan: of one bake for `options.progress`; None where several run at once.
        folder: of the bundles, which gets a contact sheet; None where each lies beside its photo.
    """
    from bakery.bake import batch
    from bakery.cli.outcomes import tell

    made = []
    with options.progress("", plan) as progress:

        def begin(one):
            progress.begin(one.output.name, len(made), len(asked))
            return progress

        counted = progress if plan is None else None
        tell(batch.bake_all(asked, jobs, begin), made, len(asked), as_json, folder, counted)
