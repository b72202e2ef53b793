"""Tests of what commands read."""

from __future__ import annotations

import errno
from pathlib import Path

import click
import pytest

from realizer.cli import inputs
from tests.commands import run as run_command


@pytest.mark.parametrize(("number", "kind"), [(errno.EACCES, click.UsageError), (errno.ENOSPC, OSError)])
def test_opening_reports_all_but_a_full_disk_as_wrong_usage(number: int, kind: type[Exception]) -> None:
    with pytest.raises(kind, match=r"x.fap|No space"), inputs.opening("x.fap"):
        raise OSError(number, "No space" if number == errno.ENOSPC else "Permission denied")


def test_reporting_names_the_option_of_a_wrong_value() -> None:
    with pytest.raises(click.BadParameter) as caught, inputs.reporting(OSError, wrong=inputs.bad("-o")):
        raise OSError("wanted a picture")
    assert caught.value.format_message() == "Invalid value for -o: wanted a picture"


def test_decode_names_the_byte_that_is_no_utf_8() -> None:
    assert inputs.decode("\ufeffHä".encode(), "x.txt", "a text") == "Hä"
    with pytest.raises(click.UsageError, match="standard input: wanted a text in UTF-8, got byte 0xFF at 1"):
        inputs.decode(b"a\xff", "-", "a text")


def test_check_suffix_takes_either_case() -> None:
    inputs.check_suffix(Path("x.PNG"), ".png")
    inputs.check_suffix(None, ".png")
    with pytest.raises(click.UsageError, match=r"x.gif: wanted a name that ends in .png or .svg"):
        inputs.check_suffix(Path("x.gif"), ".png", ".svg")


def test_read_documents_reads_files_and_speaks_texts(tmp_path: Path) -> None:
    (file := tmp_path / "a.bml").write_text('<bml id="b"/>')
    written, spoken = inputs.read_documents([str(file), "Hello there"])
    assert written == b'<bml id="b"/>'
    assert "Hello there" in str(spoken)
    with pytest.raises(click.UsageError, match="no such file"):
        inputs.read_documents([str(tmp_path / "b.bml")])


@pytest.mark.parametrize("command", ["realize", "schedule", "check", "explain"])
def test_read_documents_speaks_a_text_on_standard_input(command: str) -> None:
    done = run_command(command, "-", stdin="Hello there\n")
    assert (done.returncode, "wanted" in done.stdout + done.stderr) == (0, False)


@pytest.mark.parametrize(
    ("command", "status"),
    [
        (["faces", "check", "adda"], 2),
        (["faces", "sheet", "adda", "-o", "x.png"], 2),
        (["align", "{file}", "words"], 1),
    ],
)
def test_commands_exit_with_one_prefix_and_the_status_of_the_fault(
    command: list[str], status: int, tmp_path: Path
) -> None:
    (file := tmp_path / "hi.bml").write_text("<bml/>")
    done = run_command(*(word.format(file=file) for word in command))
    assert (done.returncode, done.stderr.startswith("realizer: ")) == (status, True)
