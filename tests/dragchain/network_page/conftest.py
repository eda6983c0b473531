"""What the tests that drive a browser share."""

from collections.abc import Iterator

import pytest
from browser import Browser


@pytest.fixture(scope="module")
def window(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """A browser for the tests of a module."""
    browser = Browser(tmp_path_factory.mktemp("profile"))
    yield browser
    browser.close()
