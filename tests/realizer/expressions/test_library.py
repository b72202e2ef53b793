"""Tests of `realizer.expressions.library`."""

import pytest

from realizer.core.errors import TableError
from realizer.expressions.expression import key
from realizer.expressions.library import ExpressionWords, builtin, expression_words, library_of
from realizer.tables.emotions import emotion_faces
from realizer.tables.templates import templates
from tests.rows import each_row


def test_expression_words_are_separated_by_semicolons() -> None:
    assert ExpressionWords("x", "", "glad; in good spirits ;").words == ("glad", "in good spirits")


def test_expression_words_exist_for_every_expression() -> None:
    rows = expression_words()
    assert len(rows) > 6
    assert all(row.name == name and row.words for name, row in rows.items())


SMIRK = 'means = ["irony"]\naus = { 12L = 0.6, 2R = 0.3 }\nonset = 0.2\napex = 0.5\noffset = 0.4\n'


@each_row("one", builtin().values())
def test_builtin_expressions_have_meanings_units_and_durations(one) -> None:
    for said in (one.means, one.features, one.aus, one.source):
        assert said
    assert min(one.onset, one.apex, one.offset) > 0
    assert all(gap.source for gap in one.gaps)


def test_builtin_has_every_expression_with_words() -> None:
    assert set(expression_words()) == set(builtin())


def test_builtin_has_templates_and_the_six_emotions() -> None:
    assert {f"template:{name.lower()}" for name in templates()} <= set(builtin())
    assert {face.lexeme for face in emotion_faces().values()} - {""} <= set(builtin())


@pytest.mark.parametrize("template", templates().values(), ids=lambda one: one.name)
def test_builtin_templates_have_possible_durations(template) -> None:
    one = builtin()[f"template:{template.name}"]
    for ends in (template.possible, template.probable):
        assert ends is None or ends[0] <= one.visible_duration <= ends[1] + 1e-9
    assert "Wojdel" in one.gaps[1].source
    assert all(gap.source.startswith("ours") for gap in one.gaps[::2])


def test_library_finds_a_name_in_several_spellings() -> None:
    assert key("Template: Ironic-smile") == key("template:ironic  smile")
    assert builtin()["raise brows"] is builtin()["RAISE_BROWS"]
    assert "template" not in builtin()


def test_near_finds_names_with_and_without_prefix() -> None:
    assert builtin().near("template:astonishmant")[0] == "template:astonishment"
    assert builtin().near("smiel") == ["SMILE"]
    assert builtin().near("grieff") == ["template:grief"]
    assert builtin().near("zzz") == []


def test_library_of_a_folder_replaces_builtin_ones_with_a_note(folder, caplog) -> None:
    library = library_of(folder(smirk=SMIRK, other=SMIRK.replace("means", 'name = "Smile"\nmeans')))
    assert library["smirk"].units == "12L+2R"
    assert library["SMILE"].units == "12L+2R"
    assert len(library) == len(builtin()) + 1
    (note,) = library.notes
    assert "other.toml: Smile replaces the built-in SMILE" in note
    assert note in caplog.text
    assert builtin()["SMILE"].units == "6+12"


def test_library_of_an_empty_folder_logs_a_warning(folder, caplog) -> None:
    assert len(library_of(folder())) == len(builtin())
    assert "found none" in caplog.text


def test_library_of_a_folder_with_a_bad_file_fails(folder) -> None:
    with pytest.raises(TableError, match=r"smirk\.toml: aus"):
        library_of(folder(smirk="onset = 1\n"))


def test_library_of_a_changed_folder_is_read_again(folder, caplog) -> None:
    made = folder(smirk=SMIRK)
    library = library_of(made)
    (made / "wry.toml").write_text(SMIRK.replace("12L", "14L"), "utf-8")
    assert "wry" not in library
    assert library_of(made) is library
    assert library["wry"].units == "14L+2R"
    (made / "wry.toml").write_text("aus = {}", "utf-8")
    assert "wry" in library_of(made)
    assert "expressions stay as they were" in caplog.text
    (made / "wry.toml").unlink()
    assert "wry" not in library_of(made)
