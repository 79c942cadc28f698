"""Prints the table of errors for people, docs/errors.md: `python -m rig.errors.errors_page > docs/errors.md`."""

from rig.errors.catalogue import catalogue

STATUS = {"refused": "2", "fault": "3", "either": "2 or 3", "unprinted": "5"}


def page() -> str:
    """Return the page of all errors as Markdown."""
    entries = catalogue()
    lines = [
        "# Errors",
        "",
        "Generated from [`rig/errors/catalogue.txt`](../rig/errors/catalogue.txt) by",
        "`python -m rig.errors.errors_page > docs/errors.md`: change the table, not this page.",
        "",
        "An error is one message on stderr: its name, what happened and where, and what to do. Names are stable, so",
        "programs may rely on them. The exit status of the command depends on the time of the error. It is 2 if the",
        "command refused before anything had moved or changed. It is 3 if something failed afterwards, or if the data",
        "do not allow a result. It is also 3 if the second half of a run is refused after the first has moved the arm.",
        "It is 5 if all was done but stdout has not taken what was to be printed. Status 1 is not an error: the run",
        "finished, and its verdict is fail.",
        "",
        "| error | status | when | what to do |",
        "| --- | --- | --- | --- |",
        *(f"| `{e.name}` | {STATUS[e.kind]} | {e.when} | {e.remedy} |" for e in entries if e.kind in STATUS),
        "",
        "## Errors of the simulated board",
        "",
        "These errors are for people who change the firmware. The emulator stops the board if the firmware does",
        "something that the chip or a part does not allow, or that is not modelled. The simulated laboratory reports",
        "this with the place in the firmware. The rig then ends with `board_link_lost`.",
        "",
        "| error | when | what to do |",
        "| --- | --- | --- |",
        *(f"| `{e.name}` | {e.when} | {e.remedy} |" for e in entries if e.kind == "simulated"),
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(page(), end="")
