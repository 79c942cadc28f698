"""How each part is wired to the Nucleo-L432KC, from the table in docs/board.md that tests hold to the firmware."""

from pathlib import Path

from svg import Drawing

BOARD = Path(__file__).parents[1] / "board.md"
# The board's two rows of pins by their printed names, pin 1 on top: UM1956, connectors CN3 and CN4.
CN3 = ("D1", "D0", "NRST", "GND", "D2", "D3", "D4", "D5", "D6", "D7", "D8", "D9", "D10", "D11", "D12")
CN4 = ("VIN", "GND", "NRST", "5V", "A7", "A6", "A5", "A4", "A3", "A2", "A1", "A0", "AREF", "3V3", "D13")
PITCH, TOP, LEFT, RIGHT, WIRE = 30, 70, 320, 460, 100
SUPPLY, GROUND, CLOCK, DATA, SELECT, READY = "#c62828", "#222222", "#1565c0", "#2e7d32", "#c25e00", "#7b1fa2"
MEANING = (
    (SUPPLY, "3.3 V"),
    (GROUND, "ground"),
    (CLOCK, "clock"),
    (DATA, "data"),
    (SELECT, "select"),
    (READY, "data ready"),
)
CLOCKS, DATAS = ("D13",), ("D11", "D12")


def table() -> tuple[list[str], list[list[str]]]:
    """The parts, and a row for each pin of the Nucleo: its printed name, the chip's, and the pins of every part."""
    rows = [
        [cell.strip().replace("*", "") for cell in line.strip("|").split("|")]
        for line in BOARD.read_text(encoding="utf-8").splitlines()
        if line.startswith("|")
    ]
    first = next(index for index, row in enumerate(rows) if row[0] == "Nucleo")
    heading, body = rows[first], rows[first + 2 :]
    end = next((index for index, row in enumerate(body) if len(row) != len(heading) or not row[0]), len(body))
    return heading[2:], body[:end]


def colour_of(pin: str, label: str) -> str:
    """The colour of a wire from a pin of the Nucleo to the one of the part that is called `label`."""
    if pin in ("3V3", "GND"):
        return SUPPLY if pin == "3V3" else GROUND
    if pin in CLOCKS or pin in DATAS:
        return CLOCK if pin in CLOCKS else DATA
    return SELECT if "CS" in label else READY


def wiring(part: str) -> Drawing:
    """The Nucleo seen from above, with the pins of one part at the ends of their wires."""
    parts, rows = table()
    wired = {row[0]: row[2 + parts.index(part)] for row in rows if row[2 + parts.index(part)]}
    drawing = Drawing(780, 600, f"{part} on a Nucleo-L432KC")
    drawing.words((390, 28), f"{part} on the Nucleo-L432KC", size=18, anchor="middle", bold=True)
    drawing.words((390, 50), "pins by the names that are printed on the board; 3.3 V only", anchor="middle")
    drawing.box(LEFT, TOP, RIGHT - LEFT, 15 * PITCH, "#eef2f6")
    drawing.words((390, TOP + 215), "Nucleo", anchor="middle", bold=True)
    drawing.words((390, TOP + 235), "L432KC", anchor="middle", bold=True)
    for pins, at, side in ((CN3, LEFT, -1), (CN4, RIGHT, 1)):
        drawing.words((at - side * 22, TOP + 15 * PITCH + 18), "CN3" if side < 0 else "CN4", "#777777", 12, "middle")
        for row, pin in enumerate(pins):
            y = TOP + (row + 0.5) * PITCH
            to = wired.get(pin, "") if not (pin == "GND" and side < 0) else ""
            anchor = "start" if side < 0 else "end"
            drawing.dot((at, y), 4, colour_of(pin, to) if to else "#999999")
            drawing.words((at - side * 10, y + 5), pin, "#222222" if to else "#999999", anchor=anchor, bold=bool(to))
            if not to:
                continue
            end, colour, name = at + side * WIRE, colour_of(pin, to), to.replace(", ", " + ")
            width = 22 + 9.2 * len(name)
            drawing.line([(at, y), (end, y)], colour, 3)
            drawing.box(end if side > 0 else end - width, y - 12, width, 24, "#ffffff", colour=colour)
            drawing.words((end + side * width / 2, y + 5), name, colour, anchor="middle", bold=True)
            if colour == SELECT:
                drawing.words((at + side * WIRE / 2, y - 5), "10 kΩ to 3V3", SELECT, 11, "middle")
    x = 60.0
    for colour, meaning in MEANING:
        drawing.line([(x, 570), (x + 26, 570)], colour, 3)
        drawing.words((x + 34, 575), meaning)
        x += 116
    return drawing


def wirings() -> dict[str, Drawing]:
    return {f"wiring-{part.lower()}.svg": wiring(part) for part in table()[0]}
