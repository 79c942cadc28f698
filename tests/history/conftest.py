"""What tests of histories share: one cluster of PostgreSQL, in which each test has a database of its own."""

from collections.abc import Iterator

import pytest

from support.history.postgres import postgresql


@pytest.fixture(scope="session")
def server() -> Iterator[str]:
    with postgresql() as url:
        yield url
