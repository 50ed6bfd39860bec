"""What the tests of the commands share."""

import pytest

from bakery.types import EXPRESSION_INDEX


@pytest.fixture(scope="session")
def names():
    return list(EXPRESSION_INDEX)
