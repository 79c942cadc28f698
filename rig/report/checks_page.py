"""Prints the table of checks for people, docs/checks.md: `python -m rig.report.checks_page > docs/checks.md`."""

from rig.report.check_words import check_words


def page_text() -> str:
    """The table as Markdown."""
    lines = [
        "# Checks of the verdict",
        "",
        "Generated from [`rig/report/checks.txt`](../rig/report/checks.txt) by",
        "`python -m rig.report.checks_page > docs/checks.md`: change the table, not this page.",
        "",
        "A run passes when every check passes. A check's name begins with the sensor's: `gyro.scale_changed`. After",
        "that, checks of an accelerometer begin with `acceleration_`, those of a magnetometer with `field_`. How each",
        "check is made, and how large a change it tells, stands in [method](method.md#what-contradicts-itself).",
        "`rig explain NAME` says what stands here.",
        "",
        "| check | it fails when | what to do |",
        "| --- | --- | --- |",
        *(f"| `{each.name}` | {each.means} | {each.remedy} |" for each in check_words().values()),
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(page_text(), end="")
