"""What the person shown agreed to, as a manifest holds it."""

from dataclasses import dataclass
from pathlib import Path

from bakery.errors import InputError
from bakery.export.hostile import text_problem
from bakery.formats.files import digest, read_bytes

LONGEST = 10_000  # letters


@dataclass(frozen=True)
class Consent:
    """A statement, and the digest of what was given."""

    statement: str  # on one line
    sha256: str  # of the file's bytes, or of the text in UTF-8


def read_consent(given: str) -> Consent:
    """The consent of `--consent TEXT|FILE`.

    Args:
        given: a text, or the path of a file that holds one.

    Raises:
        InputError: it is empty, too long, no UTF-8, or holds what no manifest may.
    """
    is_file = len(given) < 1000 and "\n" not in given and Path(given).is_file()
    data = read_bytes(given, 4 * LONGEST) if is_file else given.encode("utf-8", "surrogateescape")
    where = given if is_file else "--consent"
    try:
        statement = " ".join(data.decode("utf-8").split())
    except UnicodeDecodeError:
        raise InputError(f"{where}: not text in UTF-8; save it as such") from None
    if not 0 < len(statement) <= LONGEST:
        raise InputError(
            f"{where}: {len(statement)} letters; give a statement of 1 to {LONGEST}, or a file with one"
        )
    if trouble := text_problem(statement):
        raise InputError(f"{where}: {trouble}; take it out")
    return Consent(statement, digest(data))
