"""Changes of files that know no format but JSON and CSV: bytes, numbers, pieces; cells and values.

Every function takes a random.Random first; what it returns depends on that and its arguments alone.
"""

import json
import re

NUMBERS = (0, 1, 2, 3, 7, 8, 15, 16, 100, 127, 128, 255, 256, 4096, 32767, 32768, 65535, 65536)
NUMBERS += (1 << 20, 1 << 24, (1 << 31) - 1, 1 << 31, (1 << 32) - 2, (1 << 32) - 1, 1 << 40)
NUMBERS += ((1 << 63) - 1, (1 << 64) - 1)


def number(rng, size, near=None):
    """Bytes of an integer of `size` bytes that readers stumble over; near a value now and then."""
    value = rng.choice(NUMBERS)
    if near is not None and rng.random() < 0.4:
        value = near + rng.choice((-9, -2, -1, 1, 2, 8, near, 100))
    return (value % (1 << 8 * size)).to_bytes(size, rng.choice(("little", "big")))


def put(data, at, new):
    """Bytes with `new` over what stands at a place."""
    return data[:at] + new + data[at + len(new) :]


def flip(rng, data, others):
    out = bytearray(data)
    for _ in range(rng.choice((1, 1, 1, 2, 4, 16))):
        out[rng.randrange(len(out))] ^= 1 << rng.randrange(8)
    return bytes(out)


def set_bytes(rng, data, others):
    at, count = rng.randrange(len(data)), rng.choice((1, 1, 2, 4, 8, 32))
    return put(data, at, rng.choice((b"\0", b"\xff", rng.randbytes(1))) * count)


def set_number(rng, data, others):
    size = rng.choice((1, 2, 4, 4, 8))
    at = rng.randrange(max(len(data) - size, 1))
    if rng.random() < 0.6:
        at -= at % size
    return put(data, at, number(rng, size, near=len(data)))


def cut(rng, data, others):
    """Truncated: anywhere, or near the end."""
    if rng.random() < 0.3:
        return data[: -rng.randrange(1, min(len(data), 30))]
    return data[: rng.randrange(len(data))]


def grow(rng, data, others):
    return data + rng.choice((b"\0" * 100, rng.randbytes(40), data[: rng.randrange(len(data))]))


def remove(rng, data, others):
    at, count = rng.randrange(len(data)), rng.choice((1, 2, 4, 16, 200))
    return data[:at] + data[at + count :]


def repeat(rng, data, others):
    at, count = rng.randrange(len(data)), rng.choice((1, 4, 16, 200))
    return data[:at] + data[at : at + count] * rng.choice((2, 2, 3, 100)) + data[at + count :]


def splice(rng, data, others):
    """The start of one file and the end of another."""
    other = rng.choice(others)
    return data[: rng.randrange(len(data))] + other[rng.randrange(len(other)) :]


def move(rng, data, others):
    """A piece of one file over a place in another."""
    other, count = rng.choice(others), rng.choice((4, 16, 64, 500))
    at, start = rng.randrange(len(data)), rng.randrange(len(other))
    return put(data, at, other[start : start + count])


PLAIN = (flip, flip, set_bytes, set_number, set_number, cut, grow, remove, repeat, splice, move)


def any_bytes(rng, data, others):
    """One change that needs no format."""
    return rng.choice(PLAIN)(rng, data, others) if data else rng.randbytes(20)


# --- JSON, as text: what is not changed stays as it was, to the byte ---

TOKEN = re.compile(rb'"(?:[^"\\]|\\.)*"|[-+0-9.eE]+|true|false|null|NaN|Infinity')
VALUES = (
    "null", "true", "false", "0", "1", "-1", "2", "0.5", "-0.0", "1e308", "-1e308", "1e-320", "1e400",
    "123456789012345678901234567890", "4294967295", "2147483648", "65536", "NaN", "Infinity", '""',
    '"a"', '"0"', '"NaN"', '"\\u202e"', '"\\ud800"', '"\\u0000"', '"../../x"', '"<b>"', "[]", "{}",
    "[[]]", "[null]", '{"a": 1}', "[1, 2]", "[1, 2, 3]", '[[1, 2], [3]]', '"' + "x" * 70_000 + '"',
    "[" * 300 + "]" * 300, "[" * 100_000, "9" * 5000, "[" + "0, " * 500 + "0]", "1.5e3", "-1e-5", "3.0",
)  # fmt: skip


class Node:
    """A value of a JSON text: where it stands, its key's place, its children."""

    def __init__(self, start, key=None):
        self.start, self.end, self.key, self.children = start, start, key, []


def tree(text):
    """The values of a valid JSON text (bytes), as Nodes."""
    at = 0

    def blank():
        nonlocal at
        while text[at : at + 1] in (b" ", b"\n", b"\t", b"\r", b",", b":"):
            at += 1

    def value(key=None):
        nonlocal at
        blank()
        node, opening = Node(at, key), text[at : at + 1]
        if opening in (b"{", b"["):
            at += 1
            blank()
            while text[at : at + 1] not in (b"}", b"]"):
                name = None
                if opening == b"{":
                    name, at = (at, TOKEN.match(text, at).end()), TOKEN.match(text, at).end()
                node.children.append(value(name))
                blank()
            at += 1
        else:
            at = TOKEN.match(text, at).end()
        node.end = at
        return node

    return value()


def json_value(rng, text, root):
    """A JSON text with one value, key or member changed.

    Args:
        root: `tree` of the text.
    """
    node, above = root, None
    while node.children and (above is None or rng.random() < 0.75):
        node, above = rng.choice(node.children), node
    here, what = text[node.start : node.end], rng.random()
    first = node.start if node.key is None else node.key[0]
    member = text[first : node.end]
    if what < 0.5 or above is None:
        return text[: node.start] + rng.choice(VALUES).encode() + text[node.end :]
    if what < 0.6:  # left out, with its comma
        before = text[:first].rstrip()
        if before.endswith(b","):
            return before[:-1] + text[node.end :]
        return text[:first] + text[node.end :].lstrip().removeprefix(b",")
    if what < 0.7:  # twice, or many times
        return text[:first] + b", ".join([member] * rng.choice((2, 2, 3, 200))) + text[node.end :]
    if what < 0.78 and node.key is not None:
        name = rng.choice(
            (b'"x"', b'""', b'"\\u202e"', b'"__class__"', b"5", b'"' + b"k" * 999 + b'"')
        )
        return text[: node.key[0]] + name + text[node.key[1] :]
    if what < 0.9 and here[:1] not in b'[{"':
        return text[: node.start] + scalar(rng, here) + text[node.end :]
    other = rng.choice(above.children)  # another value of the same table
    if rng.random() < 0.5:
        other = rng.choice(root.children or [root])
    return text[: node.start] + text[other.start : other.end] + text[node.end :]


def scalar(rng, here):
    """A number near the one that stands there, as text."""
    try:
        value = json.loads(here)
    except ValueError:
        return here
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return here
    factor = rng.choice((-1, 0.5, 2, 1000, 1e9, 1e-9, 1e30, -1e300))
    changed = rng.choice((value + 1, value - 1, value * factor, -value, int(value), float(value)))
    return json.dumps(changed).encode()


NEAR = (
    "0",
    "1",
    "-1",
    "0.5",
    "2",
    "1e-9",
    "-1e-300",
    "1e-320",
    "90",
    "-180",
    "1000",
    "1e6",
    "-1e9",
)
WEIRD = (*NEAR, "1e30", "-1e150", "1e308", "-1.7e308", "65535", "3.4e38", "7e4")


def json_numbers(rng, text, root):
    """A JSON text with one to three of its numbers changed to others that JSON can hold."""
    places = {}
    for _ in range(rng.choice((1, 1, 2, 3))):
        node = root
        while node.children:
            node = rng.choice(node.children)
        here = text[node.start : node.end]
        if here[:1] in b"-0123456789":
            near = scalar(rng, here)
            places[node.start] = node.end, rng.choice((near, rng.choice(WEIRD).encode()))
    for start, (end, new) in sorted(places.items(), reverse=True):
        text = text[:start] + new + text[end:]
    return text


# --- CSV ---

CELLS = (
    "", " ", "NaN", "nan", "inf", "-inf", "1e999", "1e-999", "-1", "2", "0x1", "1_0", "½", "٣", "1e", ".",
    "-", "+.5", "1,5", '"0.5"', "=1+1", "9" * 5000, "1." + "0" * 5000, "61", "52", "6.283", "6.3", "1e308",
    "23:59:59:59.999", "00:00:00:00.000", "24:00:00:00", "1:2:3:4", "٠1:00:00:00", "-1:00:00:00",
    "00:00:00:59.9999999999", "12:30:00:00." + "9" * 400, "²:00:00:00",
)  # fmt: skip


def csv_cell(rng, data, others):
    """A take with cells, rows, columns or separators changed."""
    lines = data.split(b"\n")
    for _ in range(rng.choice((1, 1, 1, 2, 5))):
        row = rng.randrange(len(lines))
        cells = lines[row].split(b",")
        what, column = rng.random(), rng.randrange(len(cells))
        if what < 0.5:
            cells[column] = rng.choice(CELLS).encode()
        elif what < 0.6:
            cells.insert(column, rng.choice(CELLS).encode())
        elif what < 0.7:
            del cells[column]
        elif what < 0.8:
            other = rng.randrange(len(cells))
            cells[column], cells[other] = cells[other], cells[column]
        elif what < 0.85:
            lines.insert(row, rng.choice(lines))
        elif what < 0.9:
            del lines[row]
            if not lines:
                return b""
            continue
        elif what < 0.95:
            cells = cells[: rng.choice((0, 1, 2, 3))]
        else:
            joined = rng.choice((b"\r\n", b"\r", b";", b"\0", b"\t", b",,", b"\xe2\x80\xa8"))
            return b"\n".join(lines).replace(rng.choice((b"\n", b",")), joined, rng.choice((1, -1)))
        lines[row] = b",".join(cells)
    return b"\n".join(lines)


# --- words ---

WORDS = (
    "0", "-1", "1", "2", "3", "289", "290", "3000000000", "99999999999999999999", "1e308", "nan", "-inf",
    "x", "f", "v", "vt", "o", "usemtl", "list", "int", "uchar", "double", "ascii", "end_header", "vertex",
    "1/1/1", "1//1", "1/", "-5", "1 2 3 4 5 6 7", "\\", "#", "", "é",
)  # fmt: skip


def word(rng, data):
    """A text with words or lines changed, as an OBJ and the header of a PLY are made of."""
    lines = data.split(b"\n")
    for _ in range(rng.choice((1, 1, 1, 2, 5))):
        row, what = rng.randrange(len(lines)), rng.random()
        if what < 0.1:
            lines[row:row] = [rng.choice(lines)] * rng.choice((1, 1, 50))
        elif what < 0.2 and len(lines) > 1:
            del lines[row]
        else:
            words = lines[row].split() or [b""]
            words[rng.randrange(len(words))] = rng.choice(WORDS).encode()
            lines[row] = b" ".join(words)
    return b"\n".join(lines)
