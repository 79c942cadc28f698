"""Which way of using the rig fits a sensor that somebody has: what do you have? Six questions, six answers."""

from svg import Drawing

BLUE, GREEN = "#1565c0", "#2e7d32"
WAYS = (  # question in two lines, answer if yes, the page
    (
        "What do you have? Readings in a file:",
        "a log, a CSV, a bag, of something that was turned?",
        "rig look FILE",
        "from-a-robots-log.md, data-recorded-elsewhere.md",
    ),
    (
        "A Universal Robots arm?",
        "(part on our board, autopilot, lines, KVH 1775)",
        "turned by the arm",
        "first-calibration.md, autopilot.md, lines.md",
    ),
    ("A Dynamixel servomotor?", "(part on our board, autopilot, lines)", "turned by a servo", "servo.md"),
    (
        "A rate table, cameras, or a cube",
        "for known attitudes, and a logger?",
        "readings + attitudes as CSV",
        "known-attitudes.md",
    ),
    (
        "A turntable or a stop that gives",
        "known angles, and a logger?",
        "readings + sweeps as CSV",
        "data-recorded-elsewhere.md",
    ),
    (
        "A flat table and your hands?",
        "(part on our board, autopilot, lines, a logger)",
        "turned by hand",
        "by-hand.md",
    ),
)


def choice() -> Drawing:
    """The questions one below the other; yes goes right, no goes down."""
    drawing = Drawing(900, 770, "I have my own IMU: which way?")
    drawing.words((450, 30), "I have my own IMU: which way?", size=18, anchor="middle", bold=True)
    for number, (first, second, answer, page) in enumerate(WAYS):
        y = 60.0 + 105 * number
        drawing.box(40, y, 400, 66, "#eef2f6")
        drawing.words((240, y + 28), first, anchor="middle")
        drawing.words((240, y + 48), second, anchor="middle")
        drawing.arrow((440, y + 33), (540, y + 33), GREEN)
        drawing.words((490, y + 26), "yes", GREEN, anchor="middle", bold=True)
        drawing.box(540, y, 320, 66, "#e6f2e8", colour=GREEN)
        drawing.words((700, y + 28), answer, anchor="middle", bold=True)
        drawing.words((700, y + 48), page, "#555555", 13, "middle")
        drawing.arrow((240, y + 66), (240, y + 105), "#222222")
        drawing.words((252, y + 90), "no", bold=True)
    drawing.box(40, 690, 400, 56, "#fbeee0", colour="#c25e00")
    drawing.words((240, 714), "another sensor? A driver: new-sensor.md (on the board)", anchor="middle")
    drawing.words((240, 734), "or other-hardware.md (a port of its own)", anchor="middle")
    return drawing
