"""The table of a batch with all outcomes: as CSV, as a page, in a line."""

import csv
from collections.abc import Iterator
from io import StringIO

from rig.batch.batch_state import Batch, BatchPart

CSV, PAGE = "batch.csv", "batch.html"
COLUMNS = (
    "number", "serial_number", "verdict", "sweeps_repeated", "why", "certificate", "board", "who_am_i", "begun_utc",
    "ended_utc", "took_s", "folder",
)  # fmt: skip
_FORMULA = ("=", "+", "-", "@", "\t", "\r")

_PAGE = """\
<!doctype html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1"><title>{{ title }}</title>
<style>
body { font: 11pt sans-serif; margin: 2em; } table { border-collapse: collapse; }
th, td { border: 1px solid #999; padding: 0.3em 0.6em; text-align: left; vertical-align: top; }
td.pass { background: #d8f0d8; } td.fail, td.fault { background: #f6d0d0; font-weight: bold; }
td.refused { background: #f6ecc8; } .wide { overflow-x: auto; }
</style></head><body>
<h1>{{ title }}</h1>
<p>{{ summary }}.{% if batch.begun.operator %} Operator: {{ batch.begun.operator }}.{% endif %}
{% if batch.begun.work_order %} Work order: {{ batch.begun.work_order }}.{% endif %}
{% if simulated %} <strong>Measured in a simulated laboratory.</strong>{% endif %}</p>
<div class="wide"><table>
<thead><tr><th>No.</th><th>Serial number</th><th>Verdict</th><th>Repeated</th><th>Why</th><th>Certificate</th>
<th>Board</th><th>Begun (UTC)</th></tr></thead><tbody>
{% for part in batch.parts %}<tr><td>{{ part.number }}</td><td>{{ part.serial }}</td>
<td class="{{ part.state }}">{{ part.state | upper }}</td><td>{{ part.ended.repeated or "" if part.ended }}</td>
<td>{{ part.ended.why if part.ended }}</td>
<td>{% if part.ended and part.ended.certificate %}<a href="{{ part.folder | urlencode }}/certificate.html">
{{ part.ended.certificate }}</a>{% endif %}</td>
<td>{{ part.ended.chip or "" if part.ended }}</td><td>{{ part.begun_utc }}</td></tr>
{% endfor %}</tbody></table></div></body></html>
"""


def summary(batch: Batch) -> str:
    """Return the numbers of parts by outcome, in a line."""
    counts = {"passed": "pass", "failed": "fail", "refused": "refused", "ended in a fault": "fault", "open": "open"}
    phrases = [f"{count} {words}" for words, state in counts.items() if (count := batch.count(state))]
    repeated = sum(part.ended is not None and part.ended.repeated > 0 for part in batch.parts)
    more = [f"sweeps repeated in {repeated}"] if repeated else []
    parts = "1 part" if len(batch.parts) == 1 else f"{len(batch.parts)} parts"
    return f"{parts}: {', '.join([*phrases, *more])}" if batch.parts else "no parts"


def csv_of(batch: Batch) -> str:
    """Return a batch's table as CSV; a text that a spreadsheet would read as a formula gets an apostrophe."""
    file = StringIO(newline="")
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(COLUMNS)
    for part in batch.parts:
        writer.writerow([f"'{cell}" if cell.startswith(_FORMULA) else cell for cell in _cells(part)])
    return file.getvalue()


def page_of(batch: Batch, *, simulated: bool) -> str:
    """Return a batch's table as a self-contained page."""
    from jinja2 import Environment, StrictUndefined

    template = Environment(autoescape=True, undefined=StrictUndefined).from_string(_PAGE)
    title = f"Batch of {batch.begun.at_utc[:10]}"
    return template.render(batch=batch, title=title, summary=summary(batch), simulated=simulated)


def _cells(part: BatchPart) -> Iterator[str]:
    """Yield a part's cells in the columns of the batch's table."""
    ended = part.ended
    yield from (str(part.number), part.serial, part.state)
    if ended is None:
        yield from ("", "", "", "", "", part.begun_utc, "", "", part.folder)
        return
    board = "" if ended.chip is None else ended.chip.board
    identities = "" if ended.chip is None else " ".join(f"0x{identity:02x}" for identity in ended.chip.who_am_i)
    yield from (str(ended.repeated), ended.why, ended.certificate, board, identities)
    yield from (part.begun_utc, ended.at_utc, f"{ended.took_s:.1f}", part.folder)
