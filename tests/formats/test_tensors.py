"""Learned arrays as files: what is read is what was written, with the mode that the umask leaves."""

import os
import stat

import numpy as np
import pytest
from safetensors import SafetensorError, safe_open

from bakery.formats.files import DiskError
from bakery.formats.tensors import write_tensors


def test_arrays_come_back_in_order_whatever_theirs_was(tmp_path):
    turned = np.arange(12, dtype=np.float32).reshape(3, 4).T
    path = tmp_path / "a" / "weights.safetensors"
    old = os.umask(0o027)
    try:
        write_tensors({"turned": turned}, path, {"head": "makehuman"})
    finally:
        os.umask(old)
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    with safe_open(path, "np") as file:
        np.testing.assert_array_equal(file.get_tensor("turned"), turned)
        assert file.metadata() == {"head": "makehuman"}


def test_the_old_file_survives_what_cannot_be_written(tmp_path):
    path = tmp_path / "weights.safetensors"
    write_tensors({"a": np.zeros(3)}, path)
    before = path.read_bytes()
    with pytest.raises(SafetensorError):
        write_tensors({"a": np.array([None])}, path)
    assert path.read_bytes() == before and os.listdir(tmp_path) == [path.name]
    with pytest.raises(DiskError, match="is there and is no file"):
        write_tensors({"a": np.zeros(3)}, tmp_path)
