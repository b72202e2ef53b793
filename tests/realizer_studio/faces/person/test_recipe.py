"""Tests of the reader of recipes."""

from pathlib import Path

import pytest

from realizer.core.errors import FaceError
from realizer.core.toml_text import parse_toml
from realizer.face.load import list_faces
from realizer_studio.faces.person.recipe import COLOURS, appearance_of, read_recipe
from realizer_studio.faces.person.sliders import person_tables

GOOD = "\n".join(
    [
        "says = 'Eve'",
        "[targets]",
        "'macrodetails/asian-female-old' = 1.0",
        "'eyes/*eye-scale-incr' = 0.5",
        "[colours]",
        *(f"{name} = [1, 2.5, 255]" for name in COLOURS),
    ]
)


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """A folder of data with two shape targets, one of them for either eye."""
    names = ("macrodetails/asian-female-old.target.gz", "eyes/l-eye-scale-incr.target.gz")
    for name in (*names, "eyes/r-eye-scale-incr.target.gz"):
        path = tmp_path / "mpfb2/targets" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    return tmp_path


def faults(text: str, data: Path) -> list[str]:
    path = data / "recipe.toml"
    path.write_text(text, "utf-8")
    with pytest.raises(FaceError) as caught:
        read_recipe(path, data)
    lines = str(caught.value).splitlines()
    assert all(line.startswith(f"{path}: ") for line in lines)
    return [line.removeprefix(f"{path}: ") for line in lines]


def test_read_recipe_keeps_what_is_written(data: Path) -> None:
    path = data / "recipe.toml"
    path.write_text(GOOD, "utf-8")
    recipe = read_recipe(path, data)
    assert recipe.description == "Eve"
    assert recipe.targets == {"macrodetails/asian-female-old": 1.0, "eyes/*eye-scale-incr": 0.5}
    assert recipe.colours["skin"] == [1, 2.5, 255]


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("says = 'Eve'", "says = ' '", "says: wanted a sentence about the person, got ' '"),
        ("says = 'Eve'", "person = {age = 200}", "person: age: wanted a number 18..95, got 200"),
        ("says = 'Eve'", "says = 'Eve'\nsings = 1", "wanted one of says, "),
        ("*eye-scale-incr", "*eye-scale-inc", "did you mean eyes/*eye-scale-incr?"),
        ("*eye-scale-incr", "l-eye-scale-incr", "targets: eyes/l-eye-scale-incr: no such shape target"),
        ("= 0.5", "= 1.5", "targets: eyes/*eye-scale-incr: wanted a weight 0..1, got 1.5"),
        ("= 0.5", "= nan", "targets: eyes/*eye-scale-incr: wanted a weight 0..1, got nan"),
        ("= 0.5", "= true", "targets: eyes/*eye-scale-incr: wanted a weight 0..1, got True"),
        ("'macrodetails/asian-female-old' = 1.0", "", "wanted at least one of macrodetails/..., got none"),
        ("skin = [1, 2.5, 255]", "", "colours: wanted also skin"),
        ("skin = [1, 2.5, 255]", "skin = [1, 2, 256]", "colours: skin: wanted three numbers 0..255, got [1"),
        ("skin = [1, 2.5, 255]", "skin = 'pink'", "colours: skin: wanted three numbers 0..255, got 'pink'"),
        ("[colours]", "[colours]\nnose = [1, 2, 3]", "colours: nose: wanted one of skin, "),
        ("says = 'Eve'", "says = 'Eve'\nhair = 3", "hair: wanted a table, got 3"),
        ("says = 'Eve'", "says = 'Eve'\nhair = {style = 'mohawk'}", "hair: style: wanted one of buzz, "),
        ("says = 'Eve'", "says = 'Eve'\nhair = {style = ['bun']}", "hair: style: wanted one of buzz, "),
        ("says = 'Eve'", "says = 'Eve'\nhair = {colour = 3}", "got 'colour'"),
        ("says = 'Eve'", "says = 'Eve'\nlook = {scar = 1}", "look: wanted one of brow_thick, "),
        ("says = 'Eve'", "says = 'Eve'\nlook = {lips = nan}", "look: lips: wanted a number, got nan"),
    ],
)  # fmt: skip
def test_read_recipe_names_the_key_of_a_fault(old: str, new: str, fault: str, data: Path) -> None:
    (line,) = faults(GOOD.replace(old, new, 1), data)
    assert fault in line


def test_read_recipe_lists_all_faults(data: Path) -> None:
    lines = faults(GOOD.replace("= 0.5", "= -1").replace("lips = [1, 2.5, 255]", ""), data)
    assert len(lines) == 2


def test_read_recipe_of_wrong_sliders_names_these_alone(data: Path) -> None:
    lines = faults("[person]\nsex = 'robot'\nhair = 'mohawk'\n", data)
    assert [line.split(": wanted")[0] for line in lines] == ["person: sex", "person: hair"]


def test_read_recipe_describes_a_person_without_a_sentence(data: Path) -> None:
    text = GOOD.replace("says = 'Eve'\n", "") + "\n[person]\nage = 51\nsex = 1\n"
    (data / "recipe.toml").write_text(text, "utf-8")
    for name in person_tables({"age": 51, "sex": 1})["targets"]:
        (data / f"mpfb2/targets/{name}.target").touch()
    assert read_recipe(data / "recipe.toml", data).description == "A man of about 51"


def test_read_recipe_names_a_file_that_is_no_toml(data: Path) -> None:
    (line,) = faults("says", data)
    assert "Expected" in line


@pytest.mark.parametrize("info", list_faces(), ids=lambda info: info.name)
def test_read_recipe_accepts_every_shipped_recipe(info: object, data: Path) -> None:
    # Its targets are in the data, which do not ship; all else is sound.
    path = info.path / "recipe.toml"  # type: ignore[attr-defined]
    raw = parse_toml(path.read_text("utf-8"))
    for name in raw.get("targets") or person_tables(raw["person"])["targets"]:
        for side in ("l-", "r-") if "*" in name else ("",):
            target = data / "mpfb2/targets" / f"{name.replace('*', side)}.target"
            target.parent.mkdir(parents=True, exist_ok=True)
            target.touch()
    assert read_recipe(path, data).description


def test_appearance_of_an_empty_table_is_plain() -> None:
    plain, own = appearance_of({}), appearance_of({"stubble": 0.7})
    assert (plain.stubble, own.stubble) == (0.0, 0.7)
    assert own.lips == plain.lips


@pytest.mark.parametrize(
    ("table", "says"),
    [
        ({"scar": 1}, "wanted one of brow_thick"),
        ({"lips": "red"}, "lips: wanted a number"),
        ({"age": True}, "age"),
    ],
)
def test_appearance_of_refuses_what_is_no_figure(table: dict[str, object], says: str) -> None:
    with pytest.raises(FaceError, match=says):
        appearance_of(table)
