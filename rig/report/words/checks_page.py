"""Prints the table of checks for people, docs/checks.md: `python -m rig.report.words.checks_page > docs/checks.md`."""

from rig.report.words.check_words import check_words


def page_text() -> str:
    """Return the page of all checks as Markdown."""
    lines = [
        "# Checks of the verdict",
        "",
        "Generated from [`rig/report/words/checks.txt`](../rig/report/words/checks.txt) by",
        "`python -m rig.report.words.checks_page > docs/checks.md`: change the table, not this page.",
        "",
        "A run passes when every check passes. The name of a check begins with the sensor's name:",
        "`gyro.scale_changed`. For an accelerometer `acceleration_` follows, for a magnetometer `field_`. How each",
        "check works, and how large a change it detects, is explained in",
        "[method](method.md#consistency-of-a-recording). `rig explain NAME` prints a row of",
        "this table. What to do after a FAIL, step by step: [FAIL: what now](how-to/start/failed.md).",
        "",
        "| check | it fails when | what to do |",
        "| --- | --- | --- |",
        *(f"| `{row.name}` | {row.means} | {row.remedy} |" for row in check_words().values()),
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(page_text(), end="")
