"""Lack of memory is one line, whichever library finds it."""

import cv2
import numpy as np
import pytest

from bakery.bake import doctor
from bakery.errors import lacks_memory
from bakery.formats import exr
from bakery.formats.tensors import reading


def chained(error, cause):
    error.__cause__ = cause
    return error


LACKS = [
    MemoryError("what numpy raises"),
    chained(SystemError("GaussianBlur returned NULL"), MemoryError()),  # OpenCV's Python
    cv2.error("OpenCV(5.0) alloc.cpp: error: (-4:Insufficient memory) Failed to allocate 1 bytes"),
    cv2.error("Unknown C++ exception: std::bad_alloc"),
    RuntimeError("DefaultCPUAllocator: can't allocate memory: you tried to allocate 1 bytes"),
    RuntimeError("could not create a primitive"),
]


@pytest.mark.parametrize("error", LACKS, ids=lambda error: str(error)[:30])
def test_it_is_one_line(bakery, monkeypatch, error):
    def fail():
        raise error

    monkeypatch.setattr(doctor, "findings", fail)
    done = bakery("doctor")
    assert done.returncode == 1
    said = "bakery: not enough memory; close other programs or lower --resolution\n"
    assert done.stderr == said


def test_other_errors_are_not_lack_of_memory(bakery, monkeypatch):
    assert not any(map(lacks_memory, [None, ValueError("x"), cv2.error("(-215:Assertion failed)")]))
    monkeypatch.setattr(doctor, "findings", lambda: 1 / 0)
    assert "ZeroDivisionError" in bakery("doctor").stderr  # a mistake of ours shows where it is


def test_openexr_without_memory(tmp_path, monkeypatch):
    class File:
        def __init__(self, *_, **__):
            pass

        def write(self, _):
            raise RuntimeError("Unable to run compression routine")

    monkeypatch.setattr(exr.OpenEXR, "File", File)
    with pytest.raises(MemoryError):
        exr.write_exr(tmp_path / "a.exr", {"a": np.zeros((4, 4, 3), np.float16)})
    assert not list(tmp_path.iterdir())


def test_a_panic_of_safetensors_is_lack_of_memory(tmp_path):
    """It is no Exception, so nothing but this would stop it."""

    class PanicException(BaseException):
        pass

    with pytest.raises(MemoryError), reading("basis", tmp_path, "reinstall bakery"):
        raise PanicException("PyObject pointer is null")
    with pytest.raises(KeyboardInterrupt), reading("basis", tmp_path, "reinstall bakery"):
        raise KeyboardInterrupt
