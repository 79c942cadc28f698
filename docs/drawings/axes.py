"""The flange's axes, and how a sensor's lie in them: by the rig's own geometry and its own reading of `mounting`."""

from collections.abc import Sequence

import numpy as np
from svg import Drawing, Point

from rig.config.sensors.sensor_sections import MountingSection, mounting_matrix
from rig.motion.geometry import flange_attitude
from rig.motion.model import load_turner_model

RED, GREEN, BLUE = "#c62828", "#2e7d32", "#1565c0"  # x, y, z
NAMES = ("x", "y", "z")
VIEW = np.array([[-0.80, 0.60, 0.0], [0.30, 0.40, -0.87]])  # what of x, y, z goes right and down on the sheet

Vector = Sequence[float]


def seen(origin: Point, vector: Vector, size: float) -> Point:
    """Where a vector's end lies on the sheet, from the place of its beginning."""
    right, down = size * VIEW @ np.asarray(vector, dtype=float)
    return origin[0] + float(right), origin[1] + float(down)


def triad(
    drawing: Drawing, origin: Point, axes: np.ndarray, size: float, *, prefix: str = "", width: float = 3
) -> None:
    """Three arrows, the rows of `axes` in the flange's frame, each with its name at the end."""
    for axis, name, colour in zip(axes, NAMES, (RED, GREEN, BLUE), strict=True):
        drawing.arrow(origin, seen(origin, axis, size), colour)
        at = seen(origin, axis, size + 16)
        drawing.words((at[0], at[1] + 5), name, colour, 15, "middle", bold=True)


def plate(drawing: Drawing, centre: Point, sides: tuple[Vector, Vector], fill: str) -> None:
    """A rectangle about a point, by the halves of its sides in the flange's frame."""
    one, other = np.asarray(sides[0], float), np.asarray(sides[1], float)
    corners = [one + other, one - other, -one - other, -one + other]
    drawing.shape([seen(centre, each, 1) for each in corners], fill)


def disc(drawing: Drawing, centre: Point, radius: float, below: float) -> None:
    """The flange: a short cylinder whose face looks along +z."""
    ring = [(radius * np.cos(a), radius * np.sin(a)) for a in np.linspace(0, 2 * np.pi, 73)]
    drawing.shape([seen(centre, (x, y, -below), 1) for x, y in ring], "#c7cfd8")
    left, right = (
        min(ring, key=lambda r: seen(centre, (*r, 0), 1)[0]),
        max(ring, key=lambda r: seen(centre, (*r, 0), 1)[0]),
    )
    edge = [seen(centre, (*left, 0), 1), seen(centre, (*left, -below), 1)]
    edge += [seen(centre, (*right, -below), 1), seen(centre, (*right, 0), 1)]
    drawing.shape(edge, "#c7cfd8", "#c7cfd8")
    drawing.line(edge[:2], width=1.5)
    drawing.line(edge[2:], width=1.5)
    drawing.shape([seen(centre, (x, y, 0), 1) for x, y in ring], "#e9edf2")


def mounting() -> Drawing:
    """Two worked examples beside the flange's own axes."""
    drawing = Drawing(960, 430, "The flange's axes and two mountings")
    places = (
        ("the flange", "its z axis points out of the arm", None),
        (
            "the board lies flat, turned",
            "sensor x along flange +y, y along −x, z along +z",
            {"x": "+y", "y": "-x", "z": "+z"},
        ),
        (
            "the board stands upright",
            "sensor x along flange +z, y along +y, z along −x",
            {"x": "+z", "y": "+y", "z": "-x"},
        ),
    )
    for number, (title, words, given) in enumerate(places):
        centre = (160.0 + 320 * number, 270.0)
        drawing.words((centre[0], 32), title, size=17, anchor="middle", bold=True)
        if given is None:
            connector = seen(centre, (0, -106, 0), 1)
            drawing.dot(connector, 9, "#555555")
            drawing.words((connector[0] - 4, connector[1] - 16), "tool connector", "#555555", 13, "middle")
        disc(drawing, centre, 95, 40)
        if given is None:
            drawing.words((centre[0], 56), words, size=13, anchor="middle")
            triad(drawing, centre, np.eye(3), 130)
            continue
        section = MountingSection.model_validate(given)
        axes = mounting_matrix(section)
        drawing.words((centre[0], 56), words, size=13, anchor="middle")
        text = ", ".join(f"{key}: {value}" for key, value in given.items())
        drawing.words((centre[0], 412), f"mounting: {{{text}}}", size=15, anchor="middle", bold=True)
        lift = 8 if number == 1 else 46
        middle = seen(centre, (0, 0, lift), 1)
        plate(drawing, middle, (46 * axes[0], 34 * axes[1]), "#cfe8d5")
        triad(drawing, middle, axes, 105)
    return drawing


def home() -> Drawing:
    """The usual home pose from the side, with the flange's axes: how to find them without a drawing of the flange."""
    q = np.array(load_turner_model("ur10e").home_rad)
    attitude = flange_attitude(q)  # columns: the flange's axes in the base's frame
    drawing = Drawing(760, 470, "The flange's axes at the usual home pose")
    drawing.words((380, 30), "the usual home pose, from the side", size=18, anchor="middle", bold=True)
    angles = ", ".join(f"{angle:g}" for angle in np.degrees(q).round(9))
    drawing.words((380, 52), f"base, shoulder, elbow, wrists 1, 2, 3: {angles}°", anchor="middle")
    scale, foot = 380.0, (600.0, 420.0)

    def at(x_m: float, z_m: float) -> Point:
        return foot[0] + scale * x_m, foot[1] - scale * z_m

    links = [at(0, 0), at(0, 0.1807), at(0, 0.7934), at(-0.5716, 0.7934), at(-0.6914, 0.7934), at(-0.6914, 0.6769)]
    drawing.box(foot[0] - 45, foot[1] - 8, 90, 16, "#c7cfd8")
    drawing.line(links[:4], "#9aa7b4", 26)
    drawing.line(links[3:], "#9aa7b4", 18)
    for joint in links[1:5]:
        drawing.dot(joint, 8, "#5a6774")
    for name, place in (
        ("base", (at(0, 0)[0] + 60, at(0, 0)[1] + 5)),
        ("elbow", (at(0, 0.7934)[0] + 26, at(0, 0.7934)[1])),
    ):
        drawing.words(place, name)
    drawing.words((links[3][0] + 6, links[3][1] - 26), "wrists", anchor="middle")
    flange = links[-1]
    drawing.box(flange[0] - 16, flange[1] - 6, 32, 10, "#5a6774")
    for axis, name, colour in zip(attitude.T, NAMES, (RED, GREEN, BLUE), strict=True):
        if abs(axis[1]) > 0.5:  # towards the reader, or away
            away = "towards you" if axis[1] < 0 else "away from you"
            drawing.dot((flange[0], flange[1] + 10), 7, colour)
            drawing.words((flange[0] - 16, flange[1] + 15), f"{name}: {away}", colour, 15, "end", bold=True)
            continue
        end = (flange[0] + 100 * float(axis[0]), flange[1] + 10 - 100 * float(axis[2]))
        drawing.arrow((flange[0], flange[1] + 10), end, colour)
        drawing.words((end[0] + 10, end[1] + 5), name, colour, 15, bold=True)
    drawing.words((flange[0] + 100 + 30, flange[1] + 15), "towards the base", GREEN)
    drawing.words((flange[0] + 22, flange[1] + 115), "down", BLUE)
    return drawing
