"""A parameter is called by what it is: some words could mean anything."""

import ast
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]
COULD_BE_ANYTHING = {"found", "each", "said", "it", "thing"}


def test_no_parameter_is_called_by_a_word_that_could_mean_anything() -> None:
    modules = [*(REPOSITORY / "rig").rglob("*.py"), *(REPOSITORY / "firmware_host").rglob("*.py")]
    called = [
        f"{module.relative_to(REPOSITORY)}:{parameter.lineno}: {function.name}({parameter.arg})"
        for module in sorted(modules)
        for function in ast.walk(ast.parse(module.read_text("utf-8")))
        if isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef)
        for parameter in [*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs]
        if parameter.arg in COULD_BE_ANYTHING
    ]
    assert called == []
