"""The digest of a head model: whatever is changed in a head, it is another one."""

from dataclasses import fields, replace

import numpy as np
import pytest

from bakery.heads.base import HeadModel

FIELDS = [field.name for field in fields(HeadModel)]


def changed(head, name):
    """A head that differs from `head` in one value of one field."""
    value = getattr(head, name)
    if name == "whole":
        return replace(head, whole=head)
    if name == "whole_vertices":
        return replace(head, whole_vertices=np.arange(3))
    if isinstance(value, str):
        return replace(head, **{name: value + "."})
    if isinstance(value, dict):
        first, box = next(iter(value.items()))
        return replace(head, **{name: value | {first: [box[0] + 1e-6, *box[1:]]}})
    value = value.copy()
    value.flat[-1] += 1 if value.dtype.kind in "iu" else np.spacing(value.flat[-1])
    return replace(head, **{name: value})


@pytest.mark.parametrize("name", FIELDS)
def test_any_change_is_another_head(head, name):
    assert changed(head, name).digest != head.digest


@pytest.mark.parametrize(
    "other",
    [
        lambda head: replace(head, mean=head.mean.astype(np.float64)),
        lambda head: replace(head, follow=head.follow.view(np.int8)),  # the same bytes
        lambda head: replace(head, uv=head.uv.reshape(2, -1)),  # the same bytes
        lambda head: replace(head, identity_basis=head.identity_basis[:-1]),
        lambda head: replace(head, uv_rectangles=dict(list(head.uv_rectangles.items())[1:])),
        lambda head: replace(head, name=head.name + head.licence, licence=""),
    ],
)
def test_types_shapes_and_names_count(head, other):
    assert other(head).digest != head.digest


def test_the_same_head_has_the_same_digest(head):
    again = replace(
        head,
        mean=np.asfortranarray(head.mean.copy()),  # another layout in memory, no other value
        uv_rectangles=dict(reversed(head.uv_rectangles.items())),
    )
    assert again.digest == head.digest
