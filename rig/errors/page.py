"""Prints the table of errors for people, docs/errors.md: `python -m rig.errors.page > docs/errors.md`."""

from rig.errors.catalogue import catalogue

STATUS = {"refused": "2", "fault": "3", "either": "2 or 3"}


def page() -> str:
    """The table as Markdown."""
    entries = catalogue()
    lines = [
        "# Errors",
        "",
        "Generated from [`rig/errors/catalogue.txt`](../rig/errors/catalogue.txt) by",
        "`python -m rig.errors.page > docs/errors.md`: change the table, not this page.",
        "",
        "An error is one message on stderr: its name, what happened and where, and what to do. Names are stable, so",
        "programs may rely on them. A command ends with status 2 when it refused before anything had moved or changed,",
        "with 3 when something failed afterwards or the data do not allow a result. What refuses the second half of a",
        "run, when the first has moved the arm, is a fault. Status 1 is no error: the run finished, its verdict is",
        "fail.",
        "",
        "| error | status | when | what to do |",
        "| --- | --- | --- | --- |",
        *(f"| `{e.name}` | {STATUS[e.kind]} | {e.when} | {e.remedy} |" for e in entries if e.kind in STATUS),
        "",
        "## Errors of the simulated board",
        "",
        "The emulator stops the board where the firmware does what the chip or a part does not allow, or what has no",
        "model. The simulated laboratory says so with the place in the firmware, and the rig then finds",
        "`board_link_lost`.",
        "",
        "| error | when | what to do |",
        "| --- | --- | --- |",
        *(f"| `{e.name}` | {e.when} | {e.remedy} |" for e in entries if e.kind == "simulated"),
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(page(), end="")
