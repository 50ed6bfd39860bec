"""Readers with planted mistakes: the harness must find each of them, and nothing in the good one."""

import ctypes
import sys
import time

from bakery.errors import InputError


class Planted:
    """A kind whose every fiftieth case goes wrong in one way."""

    share = 1.0

    def __init__(self, name, wrong):
        self.name, self.wrong = name, wrong

    def case(self, number):
        return "case.bin", str(number).encode()

    def read(self, path):
        number = int(path.read_bytes())
        if number % 50 == 7:
            self.wrong()
        if number % 2:
            raise InputError("an odd number; give an even one")


def _multiline():
    raise InputError("two\nlines")


def _forever():
    while True:
        time.sleep(1)


def _memory():
    bytearray(250 << 20)


def kinds():
    return [
        Planted("good", lambda: None),
        Planted("traceback", lambda: {}["missing"]),
        Planted("system", lambda: open("/nowhere/at/all")),
        Planted("lines", _multiline),
        Planted("prints", lambda: print("libpng warning 7", file=sys.stderr)),
        Planted("memory", _memory),
        Planted("hang", _forever),
        Planted("crash", lambda: ctypes.string_at(0)),
    ]
