"""`random_person`: plausible people, the same for the same seed."""

from realizer.core.toml_text import parse_toml
from realizer.facebuild.person.random_person import random_person
from realizer.facebuild.person.recipe import recipe_text
from realizer.facebuild.person.sliders import person_faults
from realizer.tables import toml_table

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
