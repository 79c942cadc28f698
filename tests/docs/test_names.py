"""A parameter is called by what it is: some words could mean anything."""

import re
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

REPOSITORY = Path(__file__).parents[2]
COULD_BE_ANYTHING = re.compile(r"\bdef (\w+)\((?:[^)]*?,)?\s*(found|each|said|it|thing):")


def test_no_parameter_is_called_by_a_word_that_could_mean_anything() -> None:
    modules = [*(REPOSITORY / "rig").rglob("*.py"), *(REPOSITORY / "firmware_host").rglob("*.py")]
    called = [
        f"{module.relative_to(REPOSITORY)}: {function}({parameter})"
        for module in sorted(modules)
        for function, parameter in COULD_BE_ANYTHING.findall(module.read_text("utf-8"))
    ]
    assert called == []
