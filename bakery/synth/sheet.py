"""Contact sheets of painted pairs, for a person to judge the painter by."""

import numpy as np

from bakery.errors import InputError
from bakery.synth.pairs import iterate

COLUMNS = 8


def contact_sheet(folder, count=64, whole=False):
    """Targets of many subjects side by side.

    Args:
        folder: of shards.
        count: pictures; subjects are taken in turn, another target of each in every round.
        whole: show the photo, the deformed neutral and the target of each instead of the target.

    Returns:
        [h, w, 3] uint8 sRGB.

    Raises:
        InputError: the folder holds no shards.
    """
    subjects, need = {}, count
    for pair in iterate(folder):
        own = subjects.setdefault(pair.subject, [])
        if len(own) < 1 + need // max(len(subjects), 1):
            own.append(pair)
        if len(subjects) > need:
            break
    rounds = max(len(own) for own in subjects.values())
    chosen = [own[k] for k in range(rounds) for own in subjects.values() if k < len(own)][:count]
    sizes = {pair.target.shape for pair in chosen}
    if len(sizes) > 1:
        raise InputError(f"{folder}: pictures of several sizes; give a folder painted at one size")
    names = ("photo", "deformed", "target") if whole else ("target",)
    shown = [np.hstack([getattr(pair, name) for name in names]) for pair in chosen]
    columns = COLUMNS // len(names)
    blank = np.zeros_like(shown[0])
    shown += [blank] * (-len(shown) % columns)
    return np.vstack([np.hstack(shown[k : k + columns]) for k in range(0, len(shown), columns)])
