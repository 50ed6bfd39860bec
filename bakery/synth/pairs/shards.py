"""Paints pairs into a folder of shards; an interrupted run goes on where it stopped."""

from bakery.errors import InputError
from bakery.synth import quick, skins
from bakery.synth.pairs import NAME, Shard, write_shard
from bakery.synth.pairs.painter import PairOptions, paint_subject

SUBJECTS = 8  # of a shard


def write(heads, folder, count, seed=0, skin_folder=None, options=None):
    """Paint pairs of invented people.

    Args:
        heads: head models, taken in turn.
        folder: Path; made if missing.
        count: how many pairs the folder shall hold at least; whole subjects are painted.
        seed: integer; subject k depends on (seed, k), its head model and the skins alone.
        skin_folder: Path of skins to mix (`bakery.synth.skins`); None paints skin from pigments.
        options: PairOptions; None for the usual ones.

    Yields:
        Path of each shard once it is written.

    Raises:
        InputError: `count` is below 1, or a head has no skins in the folder.
    """
    options = options or PairOptions()
    if count < 1:
        raise InputError(f"asked for {count} pairs; needs at least 1: give -n a larger number")
    paths = [skins.skins_of(skin_folder, head) if skin_folder else [] for head in heads]
    stages = [quick.make_stage(head, skins.TEXELS) for head in heads]
    folder.mkdir(parents=True, exist_ok=True)
    subjects = -(-count // options.count)
    for number in range(-(-subjects // SUBJECTS)):
        path = folder / NAME.format(number)
        members = range(number * SUBJECTS, min((number + 1) * SUBJECTS, subjects))
        if path.exists() and len(Shard(path)) == len(members) * options.count:
            continue
        pairs = (
            pair
            for k in members
            for pair in paint_subject(
                stages[k % len(stages)], paths[k % len(stages)], (seed, k), options
            )
        )
        write_shard(path, pairs, {"seed": seed, "options": vars(options)})
        yield path
