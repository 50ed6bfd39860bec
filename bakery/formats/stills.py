"""A clip as a folder of numbered pictures, read as `video.Clip` reads a file."""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from bakery.errors import InputError
from bakery.formats.image import read_photo
from bakery.formats.video import LARGEST_SIDE

ENDINGS = (".png", ".jpg", ".jpeg")
NAME = re.compile(
    r"(.*?)(\d+)(\.[^.\d]+)"
)  # the last number counts; "shot2.0007.png" is 7 of "shot2."
RATES = (1.0, 1000.0)  # frames a second


class Stills:
    """A folder of pictures, numbered without a gap, all of one name, kind and size."""

    def __init__(self, folder: str | Path, rate: float) -> None:
        """List the frames.

        Args:
            folder: of PNG or JPEG files; others, and hidden ones, are passed over.
            rate: frames a second.

        Raises:
            InputError: no pictures, one without a number, several sequences, a number that is
                missing or there twice.
        """
        self.path, self.rate = Path(folder), float(rate)
        if not RATES[0] <= self.rate <= RATES[1]:
            raise InputError(
                f"{folder}: {rate:g} frames a second; needs {RATES[0]:g} to {RATES[1]:g}"
            )
        pictures = [
            path for path in self.path.iterdir()
            if path.suffix.lower() in ENDINGS and path.is_file() and not path.name.startswith(".")
        ]  # fmt: skip
        self.places = [place for _, place in sorted(self._numbered(pictures))]
        self.count = len(self.places)

    def _numbered(self, pictures):
        """(number, path) of each picture."""
        if not pictures:
            raise InputError(
                f"{self.path}: a folder without a PNG or JPEG; give the folder of the frames"
            )
        found, kinds = {}, {}
        for path in sorted(pictures):
            parts = NAME.fullmatch(path.name)
            if parts is None:
                raise InputError(
                    f"{path}: a picture without a number among the frames; name them as frame.0001.png"
                )
            number = int(parts[2])
            kinds.setdefault((parts[1], parts[3].lower()), path)
            if len(kinds) > 1:
                one, other = list(kinds.values())[:2]
                raise InputError(
                    f"{self.path}: frames of several kinds, such as {one.name} and {other.name}; "
                    "give a folder with one sequence"
                )
            if number in found:
                raise InputError(
                    f"{self.path}: {found[number].name} and {path.name} are both frame {number}; "
                    "remove one"
                )
            found[number] = path
        first, last = min(found), max(found)
        if last - first + 1 > len(found):
            missing = next(number for number in range(first, last) if number not in found)
            lost = last - first + 1 - len(found)
            raise InputError(
                f"{self.path}: frame {missing} is missing ({lost} of {first} to {last} are); "
                "give all frames, or number them anew"
            )
        return found.items()

    def frames(self) -> Iterator[tuple[float, np.ndarray]]:
        """Yield (seconds, [H, W, 3] uint8 sRGB) of every frame, upright.

        Raises:
            InputError: a picture that cannot be read, is too large, or of another size.
        """
        size = None
        for number, path in enumerate(self.places):
            picture = np.round(read_photo(path).encoded * 255).astype(np.uint8)
            now = picture.shape[1], picture.shape[0]
            if max(now) > LARGEST_SIDE:
                raise InputError(
                    f"{path}: {now[0]}x{now[1]} pixels; at most {LARGEST_SIDE} a side are read; "
                    "make the frames smaller"
                )
            size = size or now
            if now != size:
                raise InputError(
                    f"{path}: {now[0]}x{now[1]} pixels, the frames before have {size[0]}x{size[1]}; "
                    "give frames of one size"
                )
            yield number / self.rate, picture
