"""What anybody may put into a configuration or an override is refused by name, in a few words, at once."""

import os
import socket
import time
from pathlib import Path

import pytest

from rig.config.files.yaml_text import MAX_BYTES, MAX_DEPTH
from rig.config.load import ConfigurationRefused, load, parse
from rig.config.section import check_host
from support.laboratories.commands import rig
from support.paths import DEMO

DEMO_TEXT = DEMO.read_text(encoding="utf-8")
QUICKLY_S = 5.0  # of a processor; what these did before takes minutes, or for ever


def refusal(text: str, *overrides: str) -> str:
    """The whole message, as it is printed."""
    began_s = time.process_time()
    with pytest.raises(ConfigurationRefused) as caught:
        parse(text, "test.yaml", overrides)
    assert time.process_time() - began_s < QUICKLY_S
    return checked(caught.value)


def refusal_of(path: Path, *overrides: str) -> str:
    began_s = time.process_time()
    with pytest.raises(ConfigurationRefused) as caught:
        load(path, overrides)
    assert time.process_time() - began_s < QUICKLY_S
    return checked(caught.value)


def checked(error: ConfigurationRefused) -> str:
    message = str(error)
    assert error.name == "configuration" and error.exit_status == 2
    assert len(message) < 4500, "what is quoted must be shortened"
    assert message.replace("\n", "").isprintable(), "a terminal would obey this"
    return message


def laughs(levels: int, times: int) -> str:
    lines = ["a0: &a0 [lol]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * times)}]" for n in range(1, levels + 1)]
    return "\n".join(lines) + "\n"


def merged_laughs(levels: int, times: int) -> str:
    lines = ["a0: &a0 {x: 1}"]
    lines += [f"a{n}: &a{n} {{<<: [{', '.join([f'*a{n - 1}'] * times)}]}}" for n in range(1, levels + 1)]
    return "\n".join(lines) + "\n"


def test_aliases_that_multiply_are_refused() -> None:
    assert "line 5: more than 5000 keys and values" in refusal(laughs(9, 9))
    assert "more than 5000 keys and values" in refusal(merged_laughs(9, 9))
    assert "more than 5000 keys and values" in refusal(DEMO_TEXT, f"output.folder=[&a [1], {'*a, ' * 6000}]")


def test_aliases_that_do_not_multiply_are_read() -> None:
    axes = "{x: +x, y: +y, z: +z}"
    text = DEMO_TEXT.replace(axes, "&axes " + axes).replace("folder: runs", "folder: &name runs")
    assert parse(text).config == parse(DEMO_TEXT).config


def test_an_alias_to_itself_is_refused() -> None:
    assert "line 1: *a refers to a value that contains itself" in refusal("arm: &a {host: *a}\n")
    assert "*a refers to a value that contains itself" in refusal(DEMO_TEXT, "arm=&a [*a]")


@pytest.mark.slow
@pytest.mark.parametrize("text", ["[" * 3000, "a: " + "[" * 3000 + "]" * 3000, "{a: " * 3000, "- " * 3000, "? " * 3000])
def test_deep_nesting_is_refused(text: str) -> None:
    assert f"more than {MAX_DEPTH} sections or lists within one another" in refusal(text)


@pytest.mark.slow
def test_deep_nesting_is_refused_in_an_override() -> None:
    assert "more than 16 sections" in refusal(DEMO_TEXT, f"arm.host={'[' * 3000}")
    assert "more than 16 sections" in refusal(DEMO_TEXT, f"{'a.' * 3000}b=1")


def test_a_file_of_comments_is_refused_unread(tmp_path: Path) -> None:
    path = tmp_path / "comments.yaml"
    with path.open("wb") as file:
        for _ in range(100):
            file.write(b"# comment\n" * 100_000)
    assert f"longer than {MAX_BYTES} bytes" in refusal_of(path)


def test_a_file_that_is_missing_is_named_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationRefused) as caught:
        load(tmp_path / "rig.yaml")
    assert str(caught.value).endswith(
        "rig.yaml cannot be read: No such file or directory. Give a configuration; rig new FILE writes one, and "
        "rig demo --files . copies those of the documentation."
    )


@pytest.mark.skipif(os.name != "posix", reason="such files exist on POSIX")
@pytest.mark.parametrize("kind", ["device", "fifo", "folder", "socket"])
def test_only_regular_files_are_opened(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "config.yaml"
    with socket.socket(socket.AF_UNIX) as listener:
        if kind == "device":
            path = Path("/dev/zero")
        elif kind == "fifo":
            os.mkfifo(path)
        elif kind == "folder":
            path.mkdir()
        else:
            monkeypatch.chdir(tmp_path)  # a socket's path must be short
            listener.bind("config.yaml")
        assert "cannot be read: it is not a regular file" in refusal_of(path)
        base = tmp_path / "top.yaml"
        base.write_text(f"base: {path}\n", encoding="utf-8")
        assert "cannot be read: it is not a regular file" in refusal_of(base)


@pytest.mark.parametrize(
    ("override", "why"),
    [
        ("arm.host=[", "while parsing a flow node, expected the node content"),
        ("arm.host=!!python/object:os.x {}", "tag:yaml.org,2002:python/object:os.x: tags are not used"),
        ("arm.host=!!bool x", "tags are not used"),
        ("arm.host=! x", "tags are not used"),
        (f"world.seed={'9' * 5000}", "is too long for a number"),
        (f"world.seed={'1' + ':59' * 2000}", "is too long for a number"),
        ("world.seed=0b_", "cannot be"),
        ("output.folder=2026-02-31", "2026-02-31 cannot be: day is out of range for month"),
        ("output.folder=2026-13-45T25:61:61Z", "cannot be: month must be in 1..12"),
        ("arm.host=*x", "found undefined alias"),
        ("arm.host={a: 1, a: 2}", "a: given twice"),
        ("arm.host={[1]: 2}", "found unhashable key"),
        ("arm.host=", "must be path=value"),
        ("base=demo.yaml", "base can only be given in the file"),
        ("arm.host=\x1b[31mred", r"holds the control character \x1b"),
        ('arm.host="\\e[31mred"', r"holds the control character \x1b"),
        ("arm.host=a\x00b", r"holds the control character \x00"),
        ("arm.host=a\u202eb", r"holds the control character \u202e"),
        ("arm.ho\x1bst=a", "holds a control character"),
        ("arm.\ud800=a", "holds a control character"),
        ("arm.host=\ud800", r"holds the control character \ud800"),
    ],
)
def test_an_override_that_cannot_be_read_is_refused_by_name(override: str, why: str) -> None:
    message = refusal(DEMO_TEXT, override)
    assert "  --set " in message and why in message


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (f"arm: {'9' * 5000}\n", "line 1: "),
        ("arm:\n  host: 2026-02-31\n", "line 2: 2026-02-31 cannot be"),
        ("arm: \x1b[31m\n", r"line 1: holds the control character \x1b"),
        ("arm: 1\n\x85board: 2\n", r"line 2: holds the control character \x85"),
        ('arm: {host: "a\\u0007b"}\n', r"arm.host (line 1): holds the control character \x07"),
        ('"ar\\e[0m": 1\n', r"ar\x1b[0m (line 1): holds the control character \x1b"),
        ("arm: !!set {a}\n", "line 1: tag:yaml.org,2002:set: tags are not used in a configuration"),
        ("3: 1\n", "the file (line 1): the key '3' is not a word; quote it"),
        ("? [1, 2]\n: 1\n", "found unhashable key"),
        ("a: 1\n---\nb: 1\n", "expected a single document"),
        ("\ufffe: 1", "unacceptable character"),
    ],
)
def test_text_that_cannot_be_read_is_refused_with_its_line(text: str, why: str) -> None:
    assert why in refusal(text)


def test_bytes_that_are_no_text_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "config.yaml"
    path.write_bytes(b"arm: \xff\xfe\n")
    assert "byte 6 is not UTF-8 text" in refusal_of(path)
    path.write_bytes(DEMO_TEXT.encode("utf-16"))
    assert "is not UTF-8 text" in refusal_of(path)
    path.write_bytes(b"\xef\xbb\xbf" + DEMO_TEXT.encode())
    load(path)


@pytest.mark.slow
@pytest.mark.parametrize(
    "override",
    [
        f"output.folder={'x' * 60_000}",
        f"sensors.gyro.serial_number={'x' * 60_000}",
        f"sensors.gyro.part={'x' * 60_000}",
        f"procedure.name={'x' * 60_000}",
        f"arm.host={'x' * 60_000}",
        f"arm.{'x' * 60_000}=1",
        f"sensors.{'x' * 60_000}=1",
        f"world.sensors.{'x' * 60_000}=1",
        "x" * 1_000_000,
        f"arm.host={'x' * 1_000_000}",
        f"procedure.order=[{'wrist_1, ' * 4_000}]",
        f"world.arm.vibration_cycles_per_turn=[{'0, ' * 4_000}]",
        "arm.home_deg=[1.0e+308, 0, 0, 0, 0, 0]",
        "procedure.acceleration_deg_s2=1.0e-300",
        "arm.payload_centre_mm=[1.0e+308, 0, 0]",
    ],
)
def test_what_is_quoted_is_shortened(override: str) -> None:
    refusal(DEMO_TEXT, override)


@pytest.mark.parametrize("name", ["a/b", "..", ".", "", " a", "a\\b", "x" * 41, "[red]x[/]"])
def test_a_sensor_s_name_can_be_that_of_a_file_and_a_dataset(name: str) -> None:
    text = DEMO_TEXT.replace("  gyro:\n", f'  "{name}":\n'.replace("\\", "\\\\"))
    assert "string should" in refusal(text).lower()


NO_HOSTS = [
    "x" * 64,
    "a..b",
    ".a",
    "x" * 300,
    f"{'ü' * 63}.de",
    "\u3002",
    "my arm",
    "-arm",
    "arm_1",
    "192.168.1",
    "1.2.3.456",
]


@pytest.mark.parametrize("host", NO_HOSTS)
def test_a_host_that_cannot_be_looked_up_is_refused(host: str) -> None:
    for override in (f"arm.host={host}", f"board.port=socket://{host}:7321"):
        (problem, *_) = refusal(DEMO_TEXT, "world=null", override).splitlines()[1:]
        assert problem.strip().startswith(override.partition("=")[0])


@pytest.mark.parametrize("host", ["http://10.0.0.3", "10.0.0.3:30004", "10.0.0.3/24", "0.0.0.0", "224.0.0.1"])
def test_a_text_beside_the_address_of_an_arm_is_refused_with_the_form_of_an_address(host: str) -> None:
    assert "give it as 192.168.1.102 or ur10e.local" in refusal(DEMO_TEXT, "world=null", f'arm.host="{host}"')


@pytest.mark.parametrize(
    "host", ["10.0.0.3", "fd00::3", "ur10e", "ur10e-2.lab.example.", "prüfstand.local", "3com.example"]
)
def test_names_and_addresses_of_hosts_are_taken(host: str) -> None:
    assert check_host(host) == host


@pytest.mark.parametrize(
    "port",
    [
        *("socket://", "socket://a", "socket://a:0", "socket://a:65536", "socket://[a:1", ""),
        *("spy:///dev/ttyACM0?file=/home/me/thesis.tex", "SPY:///dev/ttyACM0", "rfc2217://a:1", "SOCKET://a:1"),
    ],
)
def test_an_address_without_host_or_port_or_of_another_kind_is_refused(port: str) -> None:
    assert "board.port" in refusal(DEMO_TEXT, "world=null", f"board.port='{port}'")


def test_a_world_answers_on_this_machine_alone() -> None:
    assert "must be a loopback address" in refusal(DEMO_TEXT, "arm.host=127.example.org")
    for host in ("192.0.2.7", "0.0.0.0", "127.example.org"):
        assert "board.port" in refusal(DEMO_TEXT, f"board.port=socket://{host}:7321")


@pytest.mark.slow
def test_thousands_of_errors_are_counted_and_the_first_are_reported() -> None:
    message = refusal("\n".join(f"k{n}: 1" for n in range(2000)))
    assert "2003 errors" in message and message.endswith("more")


@pytest.mark.slow
@pytest.mark.parametrize("words", [["plan"], ["check"], ["run", "--yes"], ["world"]])
def test_the_commands_refuse_with_status_2_and_no_traceback(words: list[str]) -> None:
    done = rig(*words, DEMO, "--set", "arm.host=[", "--set", f"arm.host={'x' * 64}")
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr.startswith("rig: configuration: ") and "Traceback" not in done.stderr
