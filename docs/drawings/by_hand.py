"""The two moves of a calibration by hand: another side comes up, or a whole turn on the table."""

from collections.abc import Callable
from math import cos, pi, sin

from svg import Drawing, Point

SIZE = {"x": 1.5, "y": 1.1, "z": 0.7}  # of the box, so that its sides differ
BLUE, BROWN, TOP, LEFT, RIGHT = "#1565c0", "#8a5200", "#ffffff", "#c3ccd7", "#e3e8ee"

Vector = tuple[float, float, float]


def by_hand() -> Drawing:
    """A flip and a turn, each with what the operator is told."""
    drawing = Drawing(960, 400, "A flip to another side, and a whole turn against a rule")
    _box(drawing, (130, 250), 62, {"x": (0, 0, 1), "y": (1, 0, 0), "z": (0, 1, 0)}, "+y")
    drawing.line([(205, 130), (240, 105), (275, 112)], BLUE, 4)
    drawing.arrow((275, 112), (300, 135), BLUE, 4)
    _box(drawing, (390, 250), 72, {"x": (-1, 0, 0), "y": (0, 0, 1), "z": (0, 1, 0)}, "+y")
    at = _box(drawing, (760, 250), 72, {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}, "+z")
    ring = [(cos(0.8 + 0.3 + t * 5.2 / 40), sin(0.8 + 0.3 + t * 5.2 / 40), 0.95) for t in range(41)]
    drawing.line([at(point) for point in ring[:-1]], BLUE, 4)
    drawing.arrow(at(ring[-2]), at(ring[-1]), BLUE, 4)
    drawing.line([at((-0.75, 0.62, 0)), at((-0.75, 1.1, 0))], BROWN, 8)
    drawing.words((260, 30), "a flip: another side comes up", size=18, anchor="middle", bold=True)
    drawing.words((760, 30), "a turn: 360° on the table", size=18, anchor="middle", bold=True)
    drawing.words((260, 350), "rest for a second, tip it over an edge, let go, rest for a second", anchor="middle")
    drawing.words((760, 350), "back against the rule, let go, rest for a second", anchor="middle")
    drawing.words((480, 385), "A side has the name of the item's axis that points out of it.", anchor="middle")
    return drawing


def _box(
    drawing: Drawing, middle: Point, scale: float, rows: dict[str, Vector], wanted: str
) -> Callable[[Vector], Point]:
    """The box as it lies: where each of its axes points in the room; its three visible sides have their names."""
    half = [sum(abs(rows[axis][i]) * SIZE[axis] / 2 for axis in rows) for i in range(3)]

    def at(place: Vector) -> Point:
        x, y, z = place
        return middle[0] + scale * (y - x) * cos(pi / 6), middle[1] + scale * ((x + y) / 2 - z)

    a, b, c = half
    sides: list[tuple[Vector, str, list[Vector]]] = [
        ((1, 0, 0), LEFT, [(a, -b, 0), (a, b, 0), (a, b, 2 * c), (a, -b, 2 * c)]),
        ((0, 1, 0), RIGHT, [(-a, b, 0), (a, b, 0), (a, b, 2 * c), (-a, b, 2 * c)]),
        ((0, 0, 1), TOP, [(-a, -b, 2 * c), (a, -b, 2 * c), (a, b, 2 * c), (-a, b, 2 * c)]),
    ]
    for outwards, fill, corners in sides:
        drawing.shape([at(corner) for corner in corners], fill)
        towards = {axis: sum(one * other for one, other in zip(rows[axis], outwards, strict=True)) for axis in rows}
        axis = max(towards, key=lambda each: abs(towards[each]))
        name = ("+" if towards[axis] > 0 else "-") + axis
        x, y, z = (sum(each) / 4 for each in zip(*corners, strict=True))
        u, v = at((x, y, z))
        colour, size = (BLUE, 22) if name == wanted else ("#222222", 16)
        drawing.words((u, v + 6), name.replace("-", "−"), colour, size, "middle", bold=name == wanted)
    return at
