"""Tests of `realizer.expressions.user_expressions`."""

import math

import pytest

from realizer.core.errors import TableError
from realizer.expressions.user_expressions import check_file, read_folder


def test_read_folder_reads_all_keys(folder) -> None:
    made = folder(
        polite="""
name = "polite smile"
means = ["greeting", "thank you"]
features = "raised corners of the mouth"
aus = { 12 = 0.5, 2L = 0.25 }
onset = 0.3
apex = 0.8
offset = 0.5
possible = [0.3, inf]
probable = [0.5, 2]
source = "the front desk"
"""
    )
    (one,) = read_folder(made)
    assert one.name == "polite smile"
    assert one.means == ("greeting", "thank you")
    assert one.aus == {(12, "BOTH"): 0.5, (2, "LEFT"): 0.25}
    assert (one.onset, one.apex, one.offset) == (0.3, 0.8, 0.5)
    assert one.possible == (0.3, math.inf)
    assert one.probable == (0.5, 2.0)
    assert one.source == "the front desk"
    assert one.to_json()["possible"] == [0.3, None]
    assert str(one.file) in one.to_json()["onset"]["source"]


def test_read_folder_needs_only_action_units(folder) -> None:
    (one,) = read_folder(folder(wry="aus = { 14R = 1 }"))
    assert one.name == "wry"
    assert one.gaps[0].source.startswith("ours")
    assert one.possible is None


BAD = {
    "aus": ("onset = 0.3", "a.toml: aus: wanted action units by intensity"),
    "unit": ("aus = { 99 = 1 }", "a.toml: aus: wanted an action unit such as 12 or 12L, got '99'"),
    "side": ("aus = { 17L = 1 }", "got '17L'"),
    "strong": ("aus = { 12 = 1.5 }", "a.toml: aus, 12: wanted an intensity above 0 and to 1, got 1.5"),
    "word": ('aus = { 12 = "much" }', "a.toml: aus.12: wanted an intensity above 0 and to 1, got 'much'"),
    "key": ("aus = { 12 = 1 }\nonsett = 1", "a.toml: onsett: wanted one of name, means"),
    "near": ("aus = { 12 = 1 }\nonsett = 1", "did you mean onset?"),
    "onset": ("aus = { 12 = 1 }\nonset = -1", "a.toml: onset: wanted seconds, 0.04 to 3600, got -1"),
    "apex": ("aus = { 12 = 1 }\napex = nan", "a.toml: apex: wanted seconds"),
    "offset": ("aus = { 12 = 1 }\noffset = true", "a.toml: offset: wanted seconds"),
    "means": ("aus = { 12 = 1 }\nmeans = [1]", "a.toml: means: wanted words"),
    "range": ("aus = { 12 = 1 }\npossible = [2, 1]", "a.toml: possible: wanted [least, most] in seconds"),
    "within": (
        "aus = { 12 = 1 }\npossible = [1, 2]\nprobable = [1, 3]",
        "a.toml: probable: wanted a range within the possible one, 1 to 2 s, got 1 to 3 s",
    ),
    "long": (
        "aus = { 12 = 1 }\napex = 9\npossible = [1, 2]",
        "a.toml: apex: wanted a visible duration within the possible 1 to 2 s, got 9.4 s",
    ),
    "name": ('name = "7"\naus = { 12 = 1 }', "a.toml: name: wanted a name that begins with a letter"),
    "neutral": ('name = "Neutral"\naus = { 12 = 1 }', "a.toml: name: wanted another name"),
    "toml": ("aus = {", "a.toml: wanted TOML, got"),
    "text": ("aus = { 12 = 1 }\nsource = 7", "a.toml: source: wanted text, got 7"),
}


@pytest.mark.parametrize("case", BAD)
def test_read_folder_names_file_and_key_of_a_fault(folder, case: str) -> None:
    text, fault = BAD[case]
    with pytest.raises(TableError) as caught:
        read_folder(folder(a=text))
    assert fault in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_read_folder_reports_all_faults_at_once(folder) -> None:
    made = folder(a="aus = { 99 = 1, 98 = 1 }\nonset = -1", b="aus = {", c="aus = { 12 = 1 }")
    with pytest.raises(TableError) as caught:
        read_folder(made)
    lines = str(caught.value).splitlines()
    assert ["a.toml" in line for line in lines] == [True, True, True, False]
    assert "b.toml" in lines[3]


def test_read_folder_refuses_two_files_of_one_name(folder) -> None:
    with pytest.raises(TableError, match=r"b.toml: name: wanted one of its own, got 'A', which .*a.toml has"):
        read_folder(folder(a="aus = { 12 = 1 }", b='name = "A"\naus = { 12 = 1 }'))


def test_check_file_compares_with_the_other_files_of_the_folder(folder) -> None:
    made = folder(one='name = "wry"\naus = { 12 = 1 }')
    check_file(made / "one.toml", b'name = "wry"\naus = { 14 = 1 }')
    check_file(made / "two.toml", b"aus = { 14 = 1 }")
    with pytest.raises(TableError, match=r"two.toml: name: wanted one of its own, got 'Wry'"):
        check_file(made / "two.toml", b'name = "Wry"\naus = { 14 = 1 }')
    with pytest.raises(TableError, match=r"two.toml: wanted TOML"):
        check_file(made / "two.toml", b"\xff")
    assert [path.name for path in made.iterdir()] == ["one.toml"]
