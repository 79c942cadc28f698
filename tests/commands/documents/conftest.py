"""What tests of signed certificates share: a laboratory that has signed one, which each of them copies."""

from collections.abc import Iterator

import pytest

from support.documents.signed_laboratory import Laboratory, make_signed_laboratory


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Laboratory]:
    with make_signed_laboratory(tmp_path_factory.mktemp("signed")) as laboratory:
        yield laboratory
