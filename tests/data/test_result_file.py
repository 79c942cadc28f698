"""One model writes and reads `result.json`; its schema is committed; files of earlier versions stay readable."""

import json
import os
from pathlib import Path

import jsonschema
import pytest

from rig.data.result_file import SIZE_MAX_BYTES, read_result, schema_text
from rig.errors import Refused
from support.documents.results import VERIFIED
from support.paths import DOCS, RECORDINGS

RUNS = ("six_observation", "verified")


@pytest.mark.parametrize("name", RUNS)
def test_what_was_written_by_the_first_version_is_read_and_written_again_byte_by_byte(name: str) -> None:
    file = RECORDINGS / name / "result.json"
    assert read_result(file).text() + "\n" == file.read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_committed_schema_is_that_of_the_model() -> None:
    committed = (DOCS / "result.schema.json").read_text(encoding="utf-8")
    assert committed == schema_text(), "again: python -m rig.data.result_file > docs/result.schema.json"


@pytest.mark.slow
@pytest.mark.parametrize("name", RUNS)
def test_results_satisfy_the_committed_schema(name: str) -> None:
    schema = json.loads((DOCS / "result.schema.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    document = json.loads((RECORDINGS / name / "result.json").read_text(encoding="utf-8"))
    validator.validate(document)
    del document["checks"][0]["unit"]
    with pytest.raises(jsonschema.ValidationError, match="unit"):
        validator.validate(document)


@pytest.mark.slow
def test_what_a_later_version_has_added_is_no_hindrance(tmp_path: Path) -> None:
    document = json.loads(VERIFIED.text())
    for place in (document, document["checks"][0], document["gyroscopes"]["gyro"], document["verification"]["gyro"]):
        place["humidity"] = 0.4
    (tmp_path / "result.json").write_text(json.dumps(document), encoding="utf-8")
    jsonschema.validate(document, json.loads((DOCS / "result.schema.json").read_text(encoding="utf-8")))
    assert read_result(tmp_path) == VERIFIED


def test_what_is_missing_or_wrong_is_refused_by_its_place(tmp_path: Path) -> None:
    document = json.loads(VERIFIED.text())
    document["gyroscopes"]["gyro"]["observations"][2]["speed_rad_s"] = "fast"
    (tmp_path / "result.json").write_text(json.dumps(document), encoding="utf-8")
    with pytest.raises(Refused, match=r"not_a_result: .*gyroscopes\.gyro\.observations\.2\.speed_rad_s"):
        read_result(tmp_path)


@pytest.mark.parametrize("speed", ["0.5", True, [0.5]])
def test_a_number_is_no_text_and_no_truth_value(speed: object, tmp_path: Path) -> None:
    document = json.loads(VERIFIED.text())
    document["gyroscopes"]["gyro"]["observations"][2]["speed_rad_s"] = speed
    (tmp_path / "result.json").write_text(json.dumps(document), encoding="utf-8")
    with pytest.raises(Refused, match=r"not_a_result: .*speed_rad_s: Input should be a valid number"):
        read_result(tmp_path)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-32", "utf-8-sig"])
def test_a_result_is_utf_8_without_a_mark_of_the_byte_order(encoding: str, tmp_path: Path) -> None:
    (tmp_path / "result.json").write_text(VERIFIED.text(), encoding=encoding)
    with pytest.raises(Refused, match="not_a_result"):
        read_result(tmp_path)


def test_provenance_may_say_more_than_this_version_knows(tmp_path: Path) -> None:
    document = json.loads(VERIFIED.text())
    document["provenance"]["operator"] = {"name": "R. Feynman"}
    (tmp_path / "result.json").write_text(json.dumps(document), encoding="utf-8")
    again = json.loads(read_result(tmp_path).text())
    assert again == document


@pytest.mark.parametrize("kind", ["pipe", "device", "huge"])
def test_only_a_regular_file_of_a_sensible_size_is_read(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path = Path("/dev/zero")
    else:
        with path.open("wb") as file:
            file.truncate(SIZE_MAX_BYTES + 1)
    with pytest.raises(Refused, match=r"no_result: .*(not a regular file|longer than 16000000 bytes)"):
        read_result(path)


def test_a_result_of_another_schema_names_it(tmp_path: Path) -> None:
    document = {**json.loads(VERIFIED.text()), "schema": "rig.result/9"}
    (tmp_path / "result.json").write_text(json.dumps(document))
    with pytest.raises(Refused, match=r"not_a_result: .* of the schema 'rig.result/9', but this version reads 'rig"):
        read_result(tmp_path)


def test_a_run_that_was_not_finished_is_said_to_be_one(tmp_path: Path) -> None:
    (tmp_path / "config.yaml").touch()
    with pytest.raises(Refused, match=r"no_result: .*not finished: go on with rig resume RUN"):
        read_result(tmp_path)
