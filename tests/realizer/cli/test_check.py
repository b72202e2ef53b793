"""Tests of `realizer check`."""

from __future__ import annotations

import os
import pty
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from realizer.cli import cli

HEAD = '<bml xmlns="http://www.bml-initiative.org/bml/bml-1.0" id="b1">\n'


def check(tmp_path: Path, text: str | bytes, *options: str) -> Result:
    document = tmp_path / "d.bml"
    document.write_bytes(text if isinstance(text, bytes) else text.encode())
    return CliRunner().invoke(cli, ["check", str(document), *options], standalone_mode=False)


def blocks(result: Result) -> list[list[str]]:
    """The lines of each fault."""
    return [block.split("\n") for block in result.stdout.rstrip("\n").split("\n\n")] if result.stdout else []


def marked(block: list[str]) -> list[str]:
    """What stands above each underline."""
    found = []
    source = ""
    for line in block[1:]:
        gutter, bar, rest = line.partition("|")
        if bar and gutter.strip():
            source = line
        elif bar and set(rest.split(maxsplit=1)[:1][0] if rest.strip() else "x") <= {"^", "-"}:
            start = len(line) - len(rest.lstrip())
            length = len(rest.split()[0])
            found.append(source[start : start + length])
    return found


def test_check_prints_a_fault_on_one_line_without_a_terminal(tmp_path: Path) -> None:
    done = check(tmp_path, HEAD + '<head id="n" lexeme="NOD" amount="7"/>\n</bml>')
    assert done.return_value == 1
    (line,) = done.stdout.splitlines()
    assert line.endswith("d.bml:2:35: PARSING_FAILURE b1:n: line 2, /bml/head[1]: amount: wanted 0..1, got 7")


def test_check_of_a_document_without_faults_prints_nothing(tmp_path: Path) -> None:
    done = check(tmp_path, HEAD + '<head id="n" lexeme="NOD"/></bml>', "--long")
    assert (done.return_value, done.stdout) == (0, "")
    assert "no fault in 1 block" in done.stderr


@pytest.mark.parametrize("text", ["", " \n", "<!-- later -->"])
def test_check_of_nothing_is_a_fault(tmp_path: Path, text: str) -> None:
    done = check(tmp_path, text)
    assert done.return_value == 1
    assert "wanted <bml>, or a text to speak, got nothing" in done.stdout


CASES = {
    "value": ('<head id="n" lexeme="NOD" amount="7"/>', ["7"], "without it, amount is 0.5"),
    "id": ('<head id="nod" lexeme="NOD"/><wait id="w" start="nodd:end"/>', ["nodd"], 'mean "nod"?'),
    "sync": ('<head id="nod" lexeme="NOD"/><wait id="w" start="nod:fin"/>', ["fin"], "nod has start, ready"),
    "lexeme": ('<faceLexeme id="f" lexeme="RAISE_BROW"/>', ["RAISE_BROW"], "mean RAISE_BROWS or"),
    "side": ('<faceFacs id="f" au="1" side="LEF"/>', ["LEF"], 'mean "LEFT"?'),
    "element": ('<hed id="h"/>', ["hed"], 'mean "head"?'),
    "attribute": ('<head id="n" lexem="NOD"/>', ["lexem", "NOD"], 'mean lexeme where it says "lexem"?'),
    "unknown": ('<head id="n" lexeme="NOD" amont="0.7"/>', ["0.7"], 'did you mean "amount"?'),
    "unknown point": ('<head id="h" lexeme="NOD" strt="1"/>', ["1"], 'mean "start"?'),
    "missing": ('<head id="n"/>', ["head"], ""),
    "duplicate": ('<wait id="w"/>\n<wait id="w"/>', ["w", "w"], ""),
    "constraint": (
        '<wait id="w"/><constraint><before ref="w:end"><sync ref="v:end"/></before></constraint>',
        ["v"],
        "there is w",
    ),
    "text": ("<speech id='s'><text>a<b/></text></speech>", ["speech"], ""),
    "body": ('<head id="n" lexeme="NOD">words</head>', ["head"], ""),
}


@pytest.mark.parametrize("case", CASES)
def test_check_underlines_a_fault_and_suggests_a_fix(case: str, tmp_path: Path) -> None:
    text, under, help = CASES[case]
    done = check(tmp_path, f"{HEAD}{text}\n</bml>", "--long")
    assert done.return_value == 1
    (block,) = blocks(done)
    assert sorted(marked(block)) == sorted(under)
    assert help in done.stdout
    assert "line 2" in block[0] or case == "duplicate"


def test_check_marks_both_faults_of_one_element(tmp_path: Path) -> None:
    text = '<head id="n" lexeme="NOD"\n  amount="x"\n  repetition="0.5"/>'
    (block,) = blocks(check(tmp_path, f"{HEAD}{text}</bml>", "--long"))
    assert marked(block) == ["x", "0.5"]
    assert block[0].split(":")[1:3] == ["3", "11"]


def test_check_shows_every_line_of_a_conflict(tmp_path: Path) -> None:
    text = HEAD + (
        '<head id="a" lexeme="NOD" start="b:end"/>\n<head id="b" lexeme="NOD"\n  start="a:end + 1"/>\n</bml>'
    )
    done = check(tmp_path, text, "--long")
    (block,) = blocks(done)
    assert "b cannot be placed" in block[0]
    assert "IMPOSSIBLE_TO_SCHEDULE" in block[0]
    assert marked(block) == ["b:end", "a:end + 1"]
    assert "takes at least" in done.stdout
    assert "b was dropped because it comes later" in done.stdout


def test_check_marks_the_references_of_a_conflicting_constraint(tmp_path: Path) -> None:
    text = HEAD + (
        '<head id="a" lexeme="NOD" start="1"/>\n'
        '<constraint id="c"><synchronize>\n<sync ref="a:start"/><sync ref="3"/>\n</synchronize>'
        "</constraint>\n</bml>"
    )
    (block,) = blocks(check(tmp_path, text, "--long"))
    assert sorted(marked(block)) == ["1", "3"]


ASTRAY = {
    "behaviour": ('<wait id="w" start="b9:x:end + 1"/>', "b9:x:end + 1", "/bml/wait[1]"),
    "required": (
        '<required><wait id="w" start="b9:x:end"/></required>',
        "b9:x:end",
        "/bml/required[1]/wait[1]",
    ),
    "constraint": (
        '<wait id="w"/><constraint><before ref="b9:x:end"><sync ref="w:end"/></before></constraint>',
        "b9:x:end",
        "/bml/constraint[1]",
    ),
    "text": (
        '<speech id="s"><text>a <sync id="t" ref="b9:x:end"/></text></speech>',
        "b9:x:end",
        "/bml/speech[1]",
    ),
    "composition": ('<wait id="w" start="1" end="0.5" />', "0.5", "/bml/wait[1]"),
}


@pytest.mark.parametrize("case", ASTRAY)
def test_check_marks_a_dangling_reference(case: str, tmp_path: Path) -> None:
    text, under, path = ASTRAY[case]
    (block,) = blocks(check(tmp_path, f"{HEAD}{text}</bml>", "--long"))
    assert under in marked(block)
    assert f"line 2, {path}: " in block[0]


def test_check_shows_the_behaviour_that_holds_a_resource(tmp_path: Path) -> None:
    text = '<gaze id="g" target="a"/>\n<gaze id="h" target="b"/>'
    done = check(tmp_path, f"{HEAD}{text}</bml>", "--long")
    (block,) = blocks(done)
    assert block[0].split(" ")[2] == "b1:h:"
    assert marked(block) == ["gaze", "gaze"]
    assert "g is here" in done.stdout


def test_check_marks_a_fault_of_a_block_in_its_start_tag(tmp_path: Path) -> None:
    text = '<bml id="c" composition="MRGE"/>'
    (block,) = blocks(check(tmp_path, text, "--long"))
    assert marked(block) == ["MRGE"]
    assert 'did you mean "MERGE"?' in "\n".join(block)


def test_check_prints_all_faults_of_a_block_that_fails(tmp_path: Path) -> None:
    text = HEAD + (
        '<required><head id="a" lexeme="NOPE"/>\n<head id="b" amount="7" lexeme="NOD"/></required>\n'
        '<faceFacs id="c" au="999"/>\n'
        '<head id="d" lexeme="NOD" start="2" end="1"/></bml>'
    )
    done = check(tmp_path, text)
    assert [line.split(" ")[2] for line in done.stdout.splitlines()] == ["b1:a:", "b1:b:", "b1:c:", "b1:d:"]


def test_check_marks_an_unknown_target(tmp_path: Path) -> None:
    scene = tmp_path / "scene.txt"
    scene.write_text("cup 0 0 1\n")
    done = check(tmp_path, f'{HEAD}<gaze id="g" target="cupp"/></bml>', "--long", "--scene", str(scene))
    (block,) = blocks(done)
    assert "NO_SUCH_TARGET" in block[0]
    assert marked(block) == ["cupp"]


BROKEN = {
    "mismatch": ("<head>\n</hed></bml>", ["</hed", "head"]),
    "quotes": ("<head id=n/></bml>", ["n/"]),
    "twice": ("<head id='a' id='b'/></bml>", ["id", "a"]),
    "open": ("<speech id='s'>", [">", "speech"]),
}


@pytest.mark.parametrize("case", BROKEN)
def test_check_marks_where_xml_is_broken(case: str, tmp_path: Path) -> None:
    text, under = BROKEN[case]
    done = check(tmp_path, HEAD + text, "--long")
    (block,) = blocks(done)
    assert "not well-formed" in block[0]
    assert sorted(marked(block)) == sorted(under)


@pytest.mark.parametrize("signs", ["a&nbsp;b", "a & b"])
def test_check_says_which_signs_of_a_text_are_read_as_text(signs: str, tmp_path: Path) -> None:
    done = check(tmp_path, f"{HEAD}<speech id='s'><text>{signs}</text></speech></bml>", "--long")
    (block,) = blocks(done)
    assert "read as text" in block[0]
    assert signs in block[0]


def test_check_distinguishes_several_documents_of_a_file(tmp_path: Path) -> None:
    one = '<bml id="x"><wait id="w" duration="1"/></bml>'
    two = '<bml id="y"><wait id="w" duration="long"/></bml>'
    (block,) = blocks(check(tmp_path, one + two + "\n", "--long"))
    assert "y:w" in block[0]
    assert marked(block) == ["long"]
    assert block[0].split(":")[2] == str(len(one) + two.index("long") + 1)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_check_marks_below_wide_characters_and_tabs(encoding: str, tmp_path: Path) -> None:
    text = '<bml id="y"><!-- 中文 é e\u0301 -->\t<wait id="w" duration="long"/></bml>'
    (block,) = blocks(check(tmp_path, text.encode(encoding), "--long"))
    row, mark = block[2], block[3]
    assert "中文 é e\u0301 -->    <wait" in row
    columns = row[: row.index("long")].replace("中文", "----").replace("\u0301", "")
    assert mark.index("^") == len(columns)
    assert mark.count("^") == 4


def test_check_cuts_a_very_long_line_around_the_fault(tmp_path: Path) -> None:
    waits = "".join(f'<wait id="w{n}"/>' for n in range(2000))
    done = check(tmp_path, f'<bml id="y">{waits}<wait id="w" duration="long"/></bml>', "--long")
    (block,) = blocks(done)
    assert all(len(line) <= 100 for line in block[1:])
    assert marked(block) == ["long"]
    assert "..." in block[2]


def test_check_says_how_bytes_that_are_not_utf_8_are_read(tmp_path: Path) -> None:
    done = check(tmp_path, b'<bml id="b">\n<wait id="\xff"/></bml>', "--long")
    (block,) = blocks(done)
    assert "read as Windows-1252, as it is not UTF-8" in block[0]


ADVICE = {
    "bmla": (
        '<head xmlns:a="http://www.asap-project.org/bmla" id="h" lexeme="NOD" a:piority="1"/>',
        "piority",
        'mean "priority"?',
    ),
    "milliseconds": ('<head id="h" lexeme="NOD" start="1500"/>', "1500", "write 1.5"),
    "muscles": ('<head id="h" lexeme="NOD" strokeStart="1" stroke="1.045"/>', "1.045", "placed where"),
    "shift": (
        '<faceShift id="f" start="1" end="1.041"><faceFacs au="1"/></faceShift>',
        "1.041",
        "placed where",
    ),
    "frame": ('<wait id="w" start="1" end="1.001"/>', "wait", "BML counts in seconds"),
}


@pytest.mark.parametrize("case", ADVICE)
def test_check_gives_advice_on_likely_mistakes(case: str, tmp_path: Path) -> None:
    text, under, help = ADVICE[case]
    done = check(tmp_path, f"{HEAD}{text}</bml>", "--long")
    assert (done.return_value, done.stdout) == (0, "")
    assert "ADVICE" in done.stderr
    assert marked(done.stderr.split("\n\n")[0].split("\n")) == [under]
    assert help in done.stderr


@pytest.mark.parametrize(
    "text",
    [
        '<head id="h" lexeme="NOD" xmlns:o="urn:o" o:amont="1" start="60"/>',
        '<gaze id="g" target="user" xmlns:a="http://www.asap-project.org/bmla" a:x="1"/>'
        '<speech id="s"><text>Hello</text></speech>',
        '<head id="h" lexeme="NOD" stroke="1"/><face id="f" start="0" end="4"><faceFacs au="1"/></face>',
    ],
)
def test_check_gives_no_advice_on_foreign_attributes_and_usual_times(text: str, tmp_path: Path) -> None:
    assert "ADVICE" not in check(tmp_path, f"{HEAD}{text}</bml>").stderr


def test_check_limits_the_advice_on_one_block(tmp_path: Path) -> None:
    short = "".join(f'<head id="h{n}" lexeme="NOD" start="{n}" end="{n}.02"/>' for n in range(50))
    assert check(tmp_path, f"{HEAD}{short}</bml>").stderr.count("ADVICE") == 20


def test_check_shows_distant_faults_of_a_line_separately(tmp_path: Path) -> None:
    gap = "<!--" + "-*" * 200 + "-->"
    text = f'<wait id="a" start="1" end="0.5"/>{gap}<wait id="b" start="a:nd"/>{gap}<wait id="a"/>'
    first, second, third = blocks(check(tmp_path, f"{HEAD}{text}</bml>", "--long"))
    assert [marked(first), marked(second), marked(third)] == [["0.5", "1"], ["nd"], ["a", "a"]]
    assert all(len(line) <= 100 for block in (first, second, third) for line in block[1:])


def test_check_prints_no_advice_if_quiet(tmp_path: Path) -> None:
    document = tmp_path / "d.bml"
    document.write_text(f'{HEAD}<head id="h" lexeme="NOD" start="1500"/></bml>')
    done = CliRunner().invoke(cli, ["-q", "check", str(document)], standalone_mode=False)
    assert (done.return_value, done.output) == (0, "")


def on_a_terminal(document: Path, **environment: str) -> str:
    """What `realizer check` writes to a terminal."""
    ours, theirs = pty.openpty()
    clean = {k: v for k, v in os.environ.items() if k not in ("NO_COLOR", "TERM")}
    command = [sys.executable, "-m", "realizer", "check", str(document)]
    process = subprocess.Popen(
        command, stdout=theirs, stderr=subprocess.DEVNULL, env={**clean, "TERM": "xterm", **environment}
    )
    os.close(theirs)
    said = b""
    while True:
        try:
            part = os.read(ours, 4096)
        except OSError:  # Linux says so at the end
            break
        if not part:
            break
        said += part
    os.close(ours)
    process.wait()
    return said.decode()


@pytest.mark.slow
def test_check_prints_source_and_colours_on_a_terminal(tmp_path: Path) -> None:
    document = tmp_path / "d.bml"
    document.write_text(f'{HEAD}<head id="n" lexeme="NOD" amount="7"/></bml>')
    shown, plain = on_a_terminal(document), on_a_terminal(document, NO_COLOR="1")
    assert "\x1b[" in shown
    assert "\x1b[" not in plain
    assert "^ wanted 0..1, got 7" in plain


DUTCH = (
    HEAD.replace(">", ' xml:lang="nl">')
    + '<speech id="s"><text>Die nonsense was quiet.</text></speech>'
    + '<speech id="t" start="s:end"><text xml:lang="en">Nonsense.</text></speech></bml>'
)


def test_check_uses_the_words_of_the_language_of_a_document(tmp_path: Path) -> None:
    printed = check(tmp_path, DUTCH).stderr
    assert '"Nonsense" is said without anger' in printed
    assert '"nonsense"' not in printed
    assert "no emotional words" not in printed


def test_check_names_a_language_without_words_once_if_verbose(tmp_path: Path) -> None:
    document = tmp_path / "d.bml"
    document.write_text(DUTCH + DUTCH)
    arguments = ["-v", "check", str(document)]
    printed = CliRunner().invoke(cli, arguments, standalone_mode=False).stderr
    assert printed.count("no emotional words for language 'nl'") == 1


def test_check_reads_words_of_another_language_from_a_file(tmp_path: Path) -> None:
    words = tmp_path / "nl.csv"
    words.write_text(
        "# source: own\n# units: none\n# licence: MIT\nword,category,origin\nonzin,disapproval,own\n"
    )
    document = HEAD + '<speech id="s"><text>Onzin.</text></speech></bml>'
    assert "without anger" not in check(tmp_path, document).stderr
    for options in (("--language", "nl"), ()):
        assert (
            '"Onzin" is said without anger'
            in check(tmp_path, document, "--words", str(words), *options).stderr
        )
    assert "without anger" not in check(tmp_path, document, "--language", "nl").stderr
    wrong = tmp_path / "wrong.csv"
    wrong.write_text("nothing\n")
    assert str(wrong) in str(check(tmp_path, document, "--words", str(wrong)).exception)


def test_check_ignores_words_of_a_text_that_a_description_replaces(tmp_path: Path) -> None:
    ssml = '<description priority="1" type="application/ssml+xml"><speak>Something else</speak></description>'
    said = HEAD + f'<speech id="s"><text>Nonsense.</text>{ssml}</speech></bml>'
    assert "without anger" not in check(tmp_path, said).stderr


def test_check_says_how_a_dialect_was_read_and_its_faults_in_strict_bml(tmp_path: Path) -> None:
    text = '<bml id="b"><head id="h" type="NOD"/><faceFacs id="f" au="4" side="left"/></bml>'
    (line,) = check(tmp_path, text).stdout.splitlines()
    assert """NOT_BML_1_0 b: line 1, /bml: read as SmartBody's BML: <head type="NOD"> as lexeme=NOD""" in line
    dialect, head, face = check(tmp_path, text, "--strict-bml").stdout.splitlines()
    assert "NOT_BML_1_0 b: line 1, /bml: this is SmartBody's BML, which is not read in strict BML" in dialect
    assert "b:h: line 1, /bml/head[1]: lexeme: wanted a word, got none" in head
    assert "b:f: line 1, /bml/faceFacs[1]: side: wanted LEFT, RIGHT or BOTH" in face


LONG = HEAD + '<expression xmlns="urn:bml-realizer:1" id="e" name="template:anger" start="0" end="90"/></bml>'


def test_check_limits_lengths_to_those_that_are_possible(tmp_path: Path) -> None:
    advised = check(tmp_path, LONG)
    assert (advised.return_value, advised.stdout) == (0, "")
    assert "ADVICE b1:e" in advised.stderr
    for more in ((), ("-q",)):
        limited = check(tmp_path, LONG, "--limit", *more)
        assert limited.return_value == 1
        (line,) = limited.stdout.splitlines()
        assert "IMPOSSIBLE_LENGTH b1:e" in line
        assert "never observed so long" in line
        assert "ADVICE b1:e" not in limited.stderr
