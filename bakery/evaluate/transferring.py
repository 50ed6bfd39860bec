"""The texture transfer on painted people it never saw, beside direct delta transfer (C6)."""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from bakery.evaluate.metrics import mse, psnr, ssim
from bakery.formats.image import write_image
from bakery.formats.mark import PAINTED
from bakery.generators.transfer import TextureTransfer
from bakery.stages.texture.expression import mouth_texels
from bakery.train.transfer.data import Performers, pair

STRIDE = (
    7  # expressions from one pair of people to the next: no two pairs show the same row of them
)


@dataclass(frozen=True)
class Scores:
    """Of one texture against the truth, sRGB-encoded 0..1, over texels that the truth saw."""

    l1: float
    l2: float  # mean of squares
    ssim: float
    mouth: float  # dB: PSNR of the sheet between the lips, and the lips


def measure(
    folder: Path, transfer: TextureTransfer, expressions: int = 8, pictures: Path | None = None
) -> Iterator[tuple[str, dict[str, Scores]]]:
    """Each person of a folder acts for the next.

    Args:
        folder: of `bakery synth performers`, people that nothing was trained on. Their textures lie
            on the painter's own geometry, with the usual mistakes of a fit laid on: kinder than a
            tracked clip.
        transfer: the network.
        expressions: how many of each pair of people; never the neutral.
        pictures: folder for a sheet a pair: performer, target's neutral, direct delta, transfer, truth.

    Yields:
        what it is, "0 for 1, expression 3", and Scores of `transfer`, of `delta`, which adds the
        performer's difference to the target's neutral, and of `neutral`, where nothing changes.

    Raises:
        InputError: fewer than two people.

    References:
        Olszewski et al., ICCV 2017, section 5 and table 1.
    """
    performers = Performers([folder], held_out=0)
    people, size = performers.people, len(performers.weight)
    skin, mouth = performers.weight > 0, mouth_texels(performers.head, size)
    known = len(people[0][0])
    for number in range(len(people)):
        other, lines = (number + 1) % len(people), []
        for k in range(expressions):
            shown = 1 + (STRIDE * (number * expressions + k)) % (known - 1)
            given = pair(people[number], people[other], shown)
            rest, truth = given["target_neutral"], given["truth"]
            made = {
                "transfer": transfer(
                    given["source"], given["source_neutral"], rest,
                    given["source_seen"], given["target_seen"],
                ),
                "delta": np.clip(rest + given["source"] - given["source_neutral"], 0, 1),
                "neutral": rest,
            }  # fmt: skip
            seen = skin & (given["seen"] > 0.5)
            yield (
                f"{number} for {other}, expression {shown}",
                {name: _scores(one, truth, seen, mouth & seen) for name, one in made.items()},
            )
            lines.append(np.hstack([given["source"], rest, made["delta"], made["transfer"], truth]))
        if pictures:
            write_image(pictures / f"{number}-for-{other}.png", np.vstack(lines), mark=PAINTED)


def _scores(made, truth, seen, mouth):
    return Scores(
        float(np.abs(made - truth)[seen].mean()), mse(made, truth, seen),
        ssim(made, truth, seen), psnr(made, truth, mouth),
    )  # fmt: skip


def mean_of(rows):
    """The mean of records of one kind, field by field."""
    kind = type(rows[0])
    return kind(
        *(float(np.mean([getattr(row, field.name) for row in rows])) for field in fields(kind))
    )


def against(ours: Scores, delta: Scores) -> dict[str, float]:
    """How far a transfer beats direct delta: shares of L1 and L2, differences of SSIM and dB."""
    return {
        "l1": 1 - ours.l1 / delta.l1, "l2": 1 - ours.l2 / delta.l2,
        "ssim": ours.ssim - delta.ssim, "mouth": ours.mouth - delta.mouth,
    }  # fmt: skip


def summary(results: list[dict[str, Scores]]) -> dict[str, object]:
    """Means of each way, and `against_delta`, see `against`."""
    means = {way: mean_of([row[way] for row in results]) for way in results[0]}
    table = {way: vars(mean) for way, mean in means.items()}
    apart = against(means["transfer"], means["delta"])
    return {"pairs": len(results), **table, "against_delta": apart}
