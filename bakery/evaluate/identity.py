"""Do the identity features know a person again whose face has moved?"""

import numpy as np

from bakery.bake.options import BuildOptions
from bakery.bake.subject import FittedSubject
from bakery.errors import InputError
from bakery.formats.portraits import landmarks_of
from bakery.generators.identity import features_of, verify
from bakery.stages.texture import TextureOptions


def faces(pairs, head, size=256):
    """The two photos of each person in the generator's frame, black outside the face.

    Args:
        pairs: [avatar_pairs.Pair].
        head: HeadModel.

    Yields:
        (name, neutral [S, S, 3] uint8, smiling [S, S, 3] uint8).
    """
    # Only the photos are looked at, not the texture: the smallest does.
    options = BuildOptions(texture=TextureOptions(resolution=512))
    for pair in pairs:
        fitted = FittedSubject(pair.neutral, landmarks_of(pair.neutral_points), head, options, size)
        observation = fitted.observe(pair.smiling, landmarks_of(pair.smiling_points))
        yield (
            pair.name,
            *(
                (seat.head_only * (seat.face[..., None] / 255.0)).astype(np.uint8)
                for seat in (fitted.neutral, observation)
            ),
        )


def measure(network, seen):
    """Verification of neutral against smiling photos.

    Args:
        network: IdentityNet.
        seen: what `faces` yields, as a list; at least two people.

    Returns:
        dict of figures.

    Raises:
        InputError: fewer than two people.
    """
    if len(seen) < 2:
        raise InputError(f"{len(seen)} people with a neutral and a smiling photo; give at least 2")
    names = [name for name, _, _ in seen]
    neutral, smiling = (features_of(network, np.stack([row[k] for row in seen])) for k in (1, 2))
    found = verify(neutral, names, smiling, names)
    return {
        "people": len(seen),
        "auc": found.auc,
        "equal_error": found.equal_error,
        "same_mean": float(found.same.mean()),
        "same_least": float(found.same.min()),
        "other_mean": float(found.other.mean()),
        "other_most": float(found.other.max()),
        "known_again": float(((neutral @ smiling.T).argmax(1) == np.arange(len(seen))).mean()),
    }
