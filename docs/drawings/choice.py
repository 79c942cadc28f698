"""Which way of using the rig fits a sensor that somebody has: seven questions, seven answers."""

from svg import Drawing

BLUE, GREEN = "#1565c0", "#2e7d32"
WAYS = (  # question, answer if yes in two lines, the page
    (
        "Is it a part that our board reads,",
        "and do you have the arm?",
        "wire it to our board",
        "how-to/start/first-calibration.md",
    ),
    (
        "Is it in an autopilot, or does it print lines,",
        "and do you have the arm?",
        "MAVLink, or lines",
        "how-to/at-the-rig/autopilot.md, how-to/at-the-rig/lines.md",
    ),
    ("Is it a KVH 1775,", "and do you have the arm?", "its own serial port", "kvh1775.md"),
    (
        "Is it one of these,",
        "and do you have a Dynamixel servomotor?",
        "turned by a servo",
        "how-to/without-an-arm/servo.md",
    ),
    (
        "Does something measure or set its attitude:",
        "a rate table, cameras, the faces of a cube?",
        "readings + attitudes as CSV",
        "how-to/without-an-arm/known-attitudes.md",
    ),
    (
        "Can you turn it by known angles: a turntable,",
        "another servo, by hand against a stop?",
        "readings + sweeps as CSV",
        "how-to/without-an-arm/data-recorded-elsewhere.md",
    ),
    (
        "Is it a gyroscope that you can lay on a table,",
        "side after side?",
        "by hand",
        "how-to/without-an-arm/by-hand.md",
    ),
)


def choice() -> Drawing:
    """The questions one below the other; yes goes right, no goes down."""
    drawing = Drawing(900, 875, "I have my own IMU: which way?")
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
    drawing.box(40, 795, 400, 56, "#fbeee0", colour="#c25e00")
    drawing.words((240, 819), "a new driver: new-sensor.md (on the board)", anchor="middle")
    drawing.words((240, 839), "or other-hardware.md (a port of its own)", anchor="middle")
    return drawing
