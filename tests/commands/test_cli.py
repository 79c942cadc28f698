"""The command line where it is used: pipes, closed streams, terminals that know no special characters."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from rig.cli import COMMANDS
from support.laboratories.commands import rig, rig_here
from support.paths import DOCS, ROOT
from support.processes.waiting import PATIENCE_S
from support.processes.warm import start_module

CONFIG = ROOT / "configs" / "ci.yaml"
FULL = Path("/dev/full")
PLAN = f"{sys.executable} -m rig plan {CONFIG}"


def shell(command: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["bash", "-o", "pipefail", "-c", command],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
        env={**os.environ, **environment},
    )


@pytest.mark.one_in(2)
@pytest.mark.slow
@pytest.mark.parametrize(
    "command", [f"{PLAN} | head -1", f"{PLAN} >&-", f"{PLAN} >&- 2>&- <&-", f"{PLAN} --json | true"]
)
def test_a_reader_that_is_not_there_is_no_error(command: str) -> None:
    done = shell(command)
    assert done.returncode == 0 and done.stderr == "", done


@pytest.mark.slow
@pytest.mark.parametrize("command", ["", "--help", "solve --help"])
def test_help_without_a_reader_or_a_known_degree_sign_is_no_traceback(command: str) -> None:
    ascii_only = {"PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "LC_ALL": "C"}
    rig = f"{sys.executable} -m rig {command}"
    for end in ("| head -c 1", ">&-", "> /dev/null"):
        done = shell(f"{rig} {end}", **ascii_only)
        assert done.returncode == 0 and done.stderr == "", (end, done)
    assert "Traceback" not in shell(f"{rig} > /dev/full").stderr


@pytest.mark.slow
def test_the_help_of_every_command_is_shown_on_a_terminal_of_plain_ascii() -> None:
    code = (
        "from rig.cli import COMMANDS, main\n"
        "for name in COMMANDS:\n"
        "    try: main([name, '--help'])\n"
        "    except SystemExit as ended: assert ended.code == 0\n"
    )
    done = shell(f'{sys.executable} -c "{code}"', PYTHONIOENCODING="ascii")
    assert done.returncode == 0 and "usage: rig world" in done.stdout, done.stderr


@pytest.mark.slow
def test_results_that_cannot_be_written_are_a_named_error() -> None:
    with (
        FULL.open("w") as full,
        start_module("plan", CONFIG, stdout=full, stderr=subprocess.PIPE, text=True) as process,
    ):
        _, errors = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 5
    assert errors.startswith("rig: output_lost: ") and "No space left" in errors
    assert errors.count("\n") == 1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("output", "errors"),
    # Where nobody can be told either, the result is written before the first word is lost.
    [(FULL, None), pytest.param(FULL, FULL, marks=pytest.mark.thorough), (os.devnull, None)],
)
def test_a_result_that_is_kept_in_a_folder_keeps_its_verdict(
    tmp_path: Path, output: str | Path, errors: Path | None
) -> None:
    samples, sweeps = DOCS / "examples" / "samples.csv", DOCS / "examples" / "sweeps.csv"
    told = errors or tmp_path / "stderr"
    with Path(output).open("w") as stdout, told.open("w") as stderr:
        words = ("solve", samples, "--sweeps", sweeps, "--out", tmp_path / "run")
        status = start_module(*words, stdout=stdout, stderr=stderr).wait(PATIENCE_S)
    assert status == 0 and (tmp_path / "run" / "result.json").exists()
    assert errors or ("output_lost" in told.read_text(encoding="utf-8")) == (output == FULL)


@pytest.mark.slow
def test_a_terminal_without_special_characters_gets_the_plan_too() -> None:
    done = shell(PLAN, PYTHONIOENCODING="ascii")
    assert done.returncode == 0 and "sweep wrist_3 cw" in done.stdout, done.stderr


def test_the_bare_command_shows_what_one_does_first_and_where_help_is() -> None:
    done = rig_here()
    assert done.returncode == 0 and done.stderr == ""
    for command in ("rig demo", "rig plan", "rig run", "rig check", "rig report", "rig history", "rig --help"):
        assert command in done.stdout


def test_blanks_about_the_equals_sign_are_told_as_what_is_wrong() -> None:
    done = rig("plan", CONFIG, "--set", "procedure.speed_deg_s", "=", "30")
    assert done.returncode == 2 and "--set takes one word without blanks" in done.stderr, done


@pytest.mark.slow
def test_on_a_terminal_there_is_a_sign_of_life_at_once() -> None:
    operator, terminal = os.openpty()
    with subprocess.Popen([*PLAN.split(), "--set", "no=1"], stdout=subprocess.DEVNULL, stderr=terminal) as process:
        os.close(terminal)
        assert os.read(operator, 4096).decode().startswith("reading the configuration")
        assert process.wait(PATIENCE_S) == 2
    os.close(operator)


@pytest.mark.thorough
@pytest.mark.slow
def test_a_narrow_terminal_gets_every_step() -> None:
    done = shell(PLAN, COLUMNS="60")
    assert done.returncode == 0
    assert json.loads(shell(f"{PLAN} --json").stdout) and done.stdout.count("sweep") >= 6


@pytest.mark.thorough
@pytest.mark.slow
def test_the_plan_of_attitudes_says_what_they_will_tell_of_each_accelerometer() -> None:
    imu = f"{sys.executable} -m rig plan {ROOT / 'configs' / 'imu.yaml'}"
    said = shell(imu).stdout
    assert "12 sweeps, 18 dwells" in said and "293.5 s in all at most" in said
    assert "rank 14 of 14, condition 1.86" in said
    document = json.loads(shell(f"{imu} --json --set procedure.second_order=true").stdout)
    assert document["attitudes"]["needed"] == 17 and document["settling_s"] == 90
    found = document["attitudes"]["sensors"]
    assert set(found) == {"lsm9ds1", "mpu9250", "adis16465"}
    assert found["mpu9250"]["scale_std"] == pytest.approx(66e-6, rel=0.02)
    assert found["adis16465"]["second_order_std_s2_m"] < found["mpu9250"]["second_order_std_s2_m"]
    told = {each["fault"]: each for each in document["acceleration_detection_limits"]["adis16465"]}
    assert "an even part, of v²/g" not in told, "it is found"
    assert told["another reading in one dwell"]["size"] < 0.004


@pytest.mark.slow
def test_attitudes_of_ones_own_that_tell_too_little_are_refused_by_the_plan() -> None:
    own = "procedure.attitudes=[[0, -90, 0], [0, -90, 90], [0, -90, 180]]"
    done = rig_here("plan", ROOT / "configs" / "imu.yaml", "--set", own)
    assert done.returncode == 2 and "rig: rank_deficient: 3 attitudes determine 9 of the 14" in done.stderr, done


@pytest.mark.one_in(2)  # all are shown by the same lines; of sweeps and of attitudes
@pytest.mark.slow
@pytest.mark.parametrize("procedure", ["six_observation", "verify", "static_attitudes", "imu"])
def test_a_procedures_help_is_the_instruction_for_the_technician(procedure: str) -> None:
    done = shell(f"{sys.executable} {ROOT / 'procedures' / procedure}.py --help")
    assert done.returncode == 0 and "Before you start:" in done.stdout and "What happens:" in done.stdout, done


HEAVY = {"h5py", "numpy", "pydantic", "rich", "scipy", "serial", "sqlalchemy", "starlette", "yaml"}
ASKED = """
import sys
from contextlib import suppress
from rig.cli import main
for command in sys.argv[1:]:
    with suppress(SystemExit):
        main([command, "--help"])
print(*sys.modules, file=sys.stderr)
"""


@pytest.mark.slow
def test_help_comes_at_once_whatever_the_command() -> None:
    listed = re.findall(r"^ {4}(\w+)", shell(f"{sys.executable} -m rig --help").stdout, re.MULTILINE)
    asked = subprocess.run([sys.executable, "-c", ASKED, *listed], capture_output=True, text=True, check=True)
    assert all(f"usage: rig {command} " in asked.stdout for command in listed) and len(listed) == len(COMMANDS)
    assert not HEAVY & {*asked.stderr.split()}


FIRST_LINE = """
import os, sys
from rig.cli import main

class First:
    def write(self, text):
        if text.strip():
            os.write(1, " ".join(sys.modules).encode())
            os._exit(0)
    def flush(self):
        pass
    def __getattr__(self, name):
        return getattr(sys.__stdout__, name)

sys.stdout = sys.stderr = First()
main(sys.argv[1:])
"""
LATER = {
    "h5py",
    "jinja2",
    "scipy",
    "serial",
    "rig.analysis.judging",
    "rig.analysis.design.planned_limits",
    "rig.runner.phases",
}
LATER |= {"rig.report.certificate.certificate_page", "rig.report.kinds.kind_registry"}


@pytest.mark.thorough
@pytest.mark.slow
@pytest.mark.parametrize("command", [f"plan {CONFIG}", f"run {CONFIG} --out RUN", "history"])
def test_what_solves_and_reports_is_loaded_after_the_first_line(command: str, tmp_path: Path) -> None:
    words = [sys.executable, "-c", FIRST_LINE, *command.replace("RUN", str(tmp_path / "run")).split()]
    environment = {**os.environ, "RIG_HISTORY": str(tmp_path / "history.sqlite")}
    asked = subprocess.run(words, capture_output=True, text=True, check=True, env=environment)
    loaded = {*asked.stdout.split()}
    assert "rig.cli" in loaded and not LATER & loaded
    assert command != "history" or "rig.config.load" not in loaded


@pytest.mark.thorough
@pytest.mark.slow
def test_a_plan_states_the_detection_limits_of_its_checks() -> None:
    document = json.loads(shell(f"{PLAN} --json").stdout)
    told = {each["fault"]: each for each in document["detection_limits"]["gyro"]}
    assert told["all scale factors change half-way"]["check"] == "scale_changed"
    said = " ".join(shell(PLAN).stdout.split())
    assert "detect in 95 of 100 runs" in said and "another reading in one sweep" in said
    twice = json.loads(shell(f"{PLAN} --json --set procedure.repeats=2").stdout)["detection_limits"]["gyro"]
    assert all(each["size"] < told[each["fault"]]["size"] for each in twice if "half-way" in each["fault"])


@pytest.mark.thorough
@pytest.mark.slow
def test_the_plan_of_a_verification_is_not_said_to_be_repeated() -> None:
    plan = f"{sys.executable} -m rig plan {ROOT / 'configs' / 'lsm9ds1_adis16465.yaml'}"
    assert "If the calibration passes, it is repeated to verify it" in shell(plan).stdout
    assert "repeated to verify" not in shell(f"{plan} --set procedure.name=verify").stdout


@pytest.mark.slow
def test_an_interrupt_while_modules_are_loaded_ends_with_the_status_of_an_interrupt(tmp_path: Path) -> None:
    """Dataclasses are made by `exec`, where CPython notes an interrupt although it is handled."""
    (tmp_path / "yaml.py").write_text("exec('raise KeyboardInterrupt')\n")
    done = subprocess.run(
        [sys.executable, "-m", "rig", "check", CONFIG],
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        stderr=subprocess.PIPE,
        timeout=PATIENCE_S,
        check=False,
    )
    assert (done.returncode, done.stderr) == (130, b"rig: interrupted\n")


THREADS = "import os, numpy; numpy.ones((900, 900)) @ numpy.ones((900, 900)); print(len(os.listdir('/proc/self/task')))"


@pytest.mark.slow
@pytest.mark.skipif((os.cpu_count() or 1) < 2 or not Path("/proc/self/task").exists(), reason="needs two cores, Linux")
def test_the_rigs_linear_algebra_runs_on_one_thread_unless_told_otherwise() -> None:
    # Whoever imported rig.cli into this process has told its children as well.
    nothing = "-u OPENBLAS_NUM_THREADS -u OMP_NUM_THREADS -u MKL_NUM_THREADS"

    def threads(first: str, told: str = nothing) -> str:
        return shell(f'env {told} {sys.executable} -c "import {first}; {THREADS}"').stdout

    assert threads("rig.cli") == threads("procedures.six_observation") == "1\n"
    assert threads("rig") != "1\n"  # a notebook's own business
    assert threads("rig.cli", told="OPENBLAS_NUM_THREADS=2") == "2\n"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        ("rig ex", {"explain", "export"}),
        ("rig explain turn_", {"turn_not_closed", "turn_too_short"}),
        ("rig show la", {"latest"}),
        ("rig export --format mat", {"mat"}),
    ],
)
def test_the_tab_key_completes_commands_names_runs_and_choices(typed: str, offered: set[str], tmp_path: Path) -> None:
    answer = tmp_path / "answer"
    asked = {"_ARGCOMPLETE": "1", "_ARGCOMPLETE_STDOUT_FILENAME": str(answer), "_ARGCOMPLETE_IFS": "|"}
    asked |= {"COMP_LINE": typed, "COMP_POINT": str(len(typed)), "COMP_TYPE": "9"}
    shell(f"cd {tmp_path}; {sys.executable} -m rig", **asked)
    assert {word.strip() for word in answer.read_text(encoding="utf-8").split("|")} == offered
