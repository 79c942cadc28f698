"""The page `practise-a-fault` as a script: the input of each terminal, and the output that must follow."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from support.paths import DOCS

PAGE = DOCS / "how-to" / "at-the-rig" / "practise-a-fault.md"
LABORATORY, RIG = "laboratory> ", "$ "
MASKS = (
    (re.compile(r"\S*runs/[^\s;]+"), "RUN"),
    (re.compile(r"127(\.\d+){3}"), "HOST"),
    (re.compile(r"during \w+ [^;,]+;"), "during a step;"),  # in which one depends on how fast the computer is
    (re.compile(r"wrist_\d c?cw"), "a sweep"),
    (re.compile(r"\d+(\.\d+)?"), "N"),
    (re.compile(r"\s+"), " "),
)


@dataclass(frozen=True, slots=True)
class Step:
    """The input after `prompt`, and the texts that must follow, in order; without a prompt, of a running command."""

    prompt: str
    typed: str
    shown: tuple[str, ...]


def mask(text: str) -> str:
    """Return a text without numbers, addresses, folders and line breaks."""
    for pattern, name in MASKS:
        text = pattern.sub(name, text)
    return text.strip()


def exercises() -> dict[str, list[Step]]:
    """Return the steps of each section by its title; those before the first have the title ''."""
    first, *others = re.split(r"^## ", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)
    sections = {"": first, **{title: text for title, _, text in (other.partition("\n") for other in others)}}
    blocks = {title: re.findall(r"```console\n(.*?)```", text, re.DOTALL) for title, text in sections.items()}
    return {title: [step for block in texts for step in _steps(block)] for title, texts in blocks.items()}


def _steps(block: str) -> Iterator[Step]:
    """Yield the steps of a block of console text: each prompt begins one."""
    for part in re.split(r"^(?=\$ |laboratory> )", block, flags=re.MULTILINE):
        prompt = next((prefix for prefix in (LABORATORY, RIG) if part.startswith(prefix)), "")
        typed, _, shown = part.removeprefix(prompt).partition("\n") if prompt else ("", "", part)
        if part.strip():
            yield Step(prompt, typed, _texts(shown))


def _texts(shown: str) -> tuple[str, ...]:
    """Return the texts that a block shows: one per line, except for continued lines and gaps `…`."""
    lines = re.split(r"\n(?=[a-z]+: |the data are|done: |not ready|Type go|PASS|An empty| )", shown)
    return tuple(mask(text) for line in lines for text in line.split(" … ") if text.strip())
