"""Rows of separated text (RFC 4180): quotes where needed; comma, semicolon or tab between fields."""

import re
from collections.abc import Iterator

from bakery.errors import InputError

SEPARATORS = (",", ";", "\t")


def records(name: str, text: str) -> Iterator[tuple[int, str]]:
    """(number of its first line, from 1; text) of each record that is not blank.

    Args:
        name: how messages call the file.

    Raises:
        InputError: a quote is not closed.
    """
    held, first, inside = [], 0, False
    for number, line in enumerate(re.split(r"\r\n|\n|\r", text), 1):
        if not held:
            if not line.strip():
                continue
            first = number
        held.append(line)
        inside ^= line.count('"') % 2 == 1
        if not inside:
            yield first, "\n".join(held)
            held = []
    if held:
        raise InputError(f"{name}: row {first}: a quote is not closed; mend or remove the row")


def separator_of(name: str, header: str) -> str:
    """What stands between the fields of a header: the one that gives most of them.

    Raises:
        InputError: none does.
    """
    best = max(SEPARATORS, key=lambda one: len(fields_of(header, one)))
    if best in header:
        return best
    other = re.search(r'timecode"?([^\w\s]|\s)', header, re.IGNORECASE)
    found = f"fields are separated by '{other[1]}'" if other else "holds one field"
    raise InputError(f"{name}: row 1: {found}; separate them by comma, semicolon or tab")


def fields_of(record: str, separator: str) -> list[str]:
    """The fields of a record, without quotes and the blanks around them."""
    parts = record.split(separator)
    if '"' not in record:
        return [part.strip() for part in parts]
    fields, inside = [], False
    for part in parts:
        if inside:
            fields[-1] += separator + part
        else:
            fields.append(part)
        inside ^= part.count('"') % 2 == 1
    return [_unquoted(field.strip()) for field in fields]


def _unquoted(field):
    if len(field) > 1 and field[0] == field[-1] == '"':
        return field[1:-1].replace('""', '"').strip()
    return field
