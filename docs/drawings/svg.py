"""Shapes and words of a drawing, as SVG text: black on white, so that it reads on a dark page too."""

from collections.abc import Sequence
from html import escape

FONT = "Liberation Sans, DejaVu Sans, Arial, sans-serif"
HEAD = 9.0  # length of an arrow's head

Point = tuple[float, float]


class Drawing:
    """A drawing of `width` by `height` units; shapes are drawn over those before them."""

    def __init__(self, width: float, height: float, title: str) -> None:
        self._parts = [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" width="{width:g}" '
            f'font-family="{FONT}" font-size="14">',
            f"<title>{escape(title)}</title>",
            f'<rect width="{width:g}" height="{height:g}" fill="#ffffff"/>',
        ]

    def line(self, points: Sequence[Point], colour: str = "#222222", width: float = 2, dash: str = "") -> None:
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        dashed = f' stroke-dasharray="{dash}"' if dash else ""
        self._parts.append(
            f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="{width:g}" '
            f'stroke-linejoin="round"{dashed}/>'
        )

    def shape(self, points: Sequence[Point], fill: str, colour: str = "#222222") -> None:
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        self._parts.append(f'<polygon points="{path}" fill="{fill}" stroke="{colour}" stroke-width="1.5"/>')

    def box(self, x: float, y: float, width: float, height: float, fill: str, *, colour: str = "#222222") -> None:
        self._parts.append(
            f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}" rx="4" fill="{fill}" '
            f'stroke="{colour}" stroke-width="1.5"/>'
        )

    def dot(self, at: Point, radius: float, fill: str) -> None:
        self._parts.append(f'<circle cx="{at[0]:.1f}" cy="{at[1]:.1f}" r="{radius:g}" fill="{fill}"/>')

    def words(
        self,
        at: Point,
        text: str,
        colour: str = "#222222",
        size: float = 14,
        anchor: str = "start",
        *,
        bold: bool = False,
    ) -> None:
        weight = ' font-weight="bold"' if bold else ""
        self._parts.append(
            f'<text x="{at[0]:.1f}" y="{at[1]:.1f}" fill="{colour}" font-size="{size:g}" '
            f'text-anchor="{anchor}"{weight}>{escape(text)}</text>'
        )

    def arrow(self, start: Point, end: Point, colour: str = "#222222", width: float = 3) -> None:
        dx, dy = end[0] - start[0], end[1] - start[1]
        length = (dx * dx + dy * dy) ** 0.5
        ux, uy = dx / length, dy / length
        neck = (end[0] - HEAD * ux, end[1] - HEAD * uy)
        self.line([start, neck], colour, width)
        sides = [
            (neck[0] - 0.5 * HEAD * uy, neck[1] + 0.5 * HEAD * ux),
            (neck[0] + 0.5 * HEAD * uy, neck[1] - 0.5 * HEAD * ux),
        ]
        self.shape([end, *sides], colour, colour)

    def text(self) -> str:
        return "\n".join([*self._parts, "</svg>", ""])
