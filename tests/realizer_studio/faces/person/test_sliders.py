"""`person_tables`: sliders become shape targets and colours."""

import pytest

from realizer.core.errors import FaceError
from realizer.core.toml_text import parse_toml
from realizer.tables import toml_table
from realizer_studio.faces.person.recipe import COLOURS, recipe_text
from realizer_studio.faces.person.sliders import DEFAULTS, person_faults, person_tables, random_person


def macros(person):
    return {name: w for name, w in person_tables(person)["targets"].items() if name.startswith("macro")}


def test_person_tables_have_every_colour():
    assert set(person_tables({})["colours"]) == set(COLOURS)


@pytest.mark.parametrize(
    "person",
    [{}, {"age": 60, "sex": 0.3, "weight": 0.4, "muscle": -0.5, "people": {"asian": 2, "african": 1}}],
)
def test_person_tables_have_shares_that_add_up(person):
    found = macros(person)
    peoples = sum(weight for name, weight in found.items() if "universal" not in name)
    assert peoples == pytest.approx(1, abs=0.01)
    assert sum(found.values()) - peoples == pytest.approx(1, abs=0.01)


def test_person_tables_age_shape_hair_and_lines():
    young, old = (person_tables({"age": age}) for age in (20, 80))
    assert not any("-old" in name for name in young["targets"])
    assert not any("-young" in name for name in old["targets"])
    assert (young["hair"]["grey"], old["hair"]["grey"]) == (0, 1)
    assert young["look"]["age"] < old["look"]["age"]


@pytest.mark.parametrize("name", list(toml_table("person.toml")["sliders"]))
def test_person_tables_mix_a_slider_s_targets_either_way(name):
    less, none, more = (set(person_tables({name: amount})["targets"]) for amount in (-1, 0, 1))
    assert less - none
    assert more - none
    assert not (less - none) & (more - none)


def test_person_tables_darken_skin_evenly():
    tones = [sum(person_tables({"skin": tone / 20})["colours"]["skin"]) for tone in range(21)]
    assert sorted(tones, reverse=True) == tones


@pytest.mark.parametrize(
    ("person", "fault"),
    [
        ({"age": 12}, r"age: wanted a number 18\.\.95, got 12"),
        ({"skin": "dark"}, r"skin: wanted a number 0\.\.1, got 'dark'"),
        ({"nose_width": 2}, r"nose_width: wanted a number -1\.\.1, got 2"),
        ({"eyes": "purple"}, r"eyes: wanted one of darkbrown, .*, got 'purple'"),
        ({"people": {"martian": 1}}, r"people: wanted shares above 0 of african, asian, caucasian"),
        ({"people": {"asian": 0}}, r"people: wanted shares above 0"),
        ({"noze": 0.1}, r"person: wanted one of age, .*, got 'noze'"),
    ],
)
def test_person_tables_name_what_is_wrong(person, fault):
    with pytest.raises(FaceError, match=fault):
        person_tables(person)
    assert len(person_faults(person)) == 1


def test_person_faults_of_the_defaults_are_none():
    assert person_faults(DEFAULTS) == []


MANY = [random_person(seed) for seed in range(200)]


def test_random_people_are_sound_recipes():
    for recipe in MANY:
        assert person_faults(recipe["person"]) == []
        assert recipe["hair"]["style"] in toml_table("hair.toml")["styles"]
        assert parse_toml(recipe_text(recipe)) == recipe


def test_random_people_are_the_same_for_the_same_seed():
    assert random_person(7) == random_person(7)
    assert len({recipe["says"] for recipe in MANY}) == len(MANY)


def test_random_people_vary():
    persons = [recipe["person"] for recipe in MANY]
    assert 60 < sum(person["sex"] > 0.5 for person in persons) < 140
    assert min(person["age"] for person in persons) < 25
    assert max(person["age"] for person in persons) > 65
    assert len({person["hair"] for person in persons}) >= 6
    assert max(person["skin"] for person in persons) > 0.6
    assert min(person["skin"] for person in persons) < 0.15
