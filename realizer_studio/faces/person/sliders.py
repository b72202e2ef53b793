"""Sliders of a recipe: age, sex, shape and colours, converted to shape targets and colours.

`realizer/tables/person.toml` lists the targets of each slider.
"""

import math
from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np

from realizer.core.errors import FaceError
from realizer.tables import toml_table

AGES = (18.0, 95.0)  # years
PEOPLES = ("african", "asian", "caucasian")
YOUNG, OLD = 22.0, 80.0  # years for which the data has shapes
LINED = 24.0, 82.0  # years at which lines of age begin, and are complete
GREYING = 44.0, 80.0  # years at which hair begins to turn white, and is white
SHARES = {"sex": (0.0, 1.0), "weight": (-1.0, 1.0), "muscle": (-1.0, 1.0), "skin": (0.0, 1.0)}
WORDS = {"shape": "shapes", "hair": "hair_colours", "eyes": "eye_colours"}
DEFAULTS: Mapping[str, Any] = {
    "age": 30, "sex": 0.5, "weight": 0.0, "muscle": 0.0, "skin": 0.25, "shape": "plain",
    "hair": "brown", "eyes": "brown", "people": {"caucasian": 1.0},
}  # fmt: skip


def person_faults(person: Mapping[str, Any]) -> list[str]:
    """Return a sentence for each fault in the table [person] of a recipe."""
    table = toml_table("person.toml")
    faults = []
    keys = (*DEFAULTS, *table["sliders"])
    for key, value in person.items():
        if key not in keys:
            faults.append(f"person: wanted one of {', '.join(keys)}, got {key!r}")
        elif key in WORDS:
            if value not in table[WORDS[key]]:
                faults.append(f"person: {key}: wanted one of {', '.join(table[WORDS[key]])}, got {value!r}")
        elif key == "people":
            faults += _people_faults(value)
        else:
            low, high = AGES if key == "age" else SHARES.get(key, (-1.0, 1.0))
            if not is_number(value) or not low <= value <= high:
                faults.append(f"person: {key}: wanted a number {low:g}..{high:g}, got {value!r}")
    return faults


def person_tables(person: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return [targets], [colours], [hair] and [look] of a recipe for its [person].

    Raises:
        FaceError: a slider is unknown or out of range.
    """
    if faults := person_faults(person):
        raise FaceError("\n".join(faults))
    values = {**DEFAULTS, **person}
    lined, grey = (round(_share(values["age"], *ends), 3) for ends in (LINED, GREYING))
    return {
        "targets": _targets(values),
        "colours": _colours(values),
        "hair": {"grey": grey},
        "look": {"age": lined, "brow_grey": round(0.7 * grey, 3)},
    }


def person_targets(person: Mapping[str, Any]) -> dict[str, float]:
    """Return [targets] of a recipe for its [person], whose sliders are within their ranges."""
    return _targets({**DEFAULTS, **person})


def description_of(person: Mapping[str, Any]) -> str:
    """Return a sentence about a person for lists of faces; faulty sliders have their defaults."""
    values = {key: person[key] for key in ("age", "sex") if is_number(person.get(key))}
    age, sex = ({**DEFAULTS, **values}[key] for key in ("age", "sex"))
    word = "woman" if sex < 0.4 else "man" if sex > 0.6 else "person"
    return f"A {word} of about {age:g}"


def is_number(value: Any) -> bool:
    """Return whether a value of a recipe is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _share(age: float, begin: float, end: float) -> float:
    return float(np.clip((age - begin) / (end - begin), 0, 1))


def _people_faults(people: Any) -> list[str]:
    expectation = f"person: people: wanted shares above 0 of {', '.join(PEOPLES)}"
    if not isinstance(people, dict) or not people:
        return [f"{expectation}, got {people!r}"]
    bad = {k: v for k, v in people.items() if k not in PEOPLES or not is_number(v) or v < 0}
    if bad or sum(people.values()) <= 0:
        return [f"{expectation}, got {bad or people!r}"]
    return []


def _targets(values: Mapping[str, Any]) -> dict[str, float]:
    """Return the weight of each shape target."""
    table, out = toml_table("person.toml"), Counter[str]()
    total = sum(values["people"].values())
    old = _share(values["age"], YOUNG, OLD)
    builds = {"muscle": values["muscle"], "weight": values["weight"]}
    for sex, sexed in (("female", 1 - values["sex"]), ("male", values["sex"])):
        for age, aged in (("young", 1 - old), ("old", old)):
            for people, share in values["people"].items():
                out[f"macrodetails/{people}-{sex}-{age}"] += sexed * aged * share / total
            for muscle, strong in _between(builds["muscle"], "muscle"):
                for weight, heavy in _between(builds["weight"], "weight"):
                    out[f"macrodetails/universal-{sex}-{age}-{muscle}-{weight}"] += (
                        sexed * aged * strong * heavy
                    )
    for name, slider in table["sliders"].items():
        amount = values.get(name, 0.0)
        for target, weight in slider["more" if amount > 0 else "less"].items():
            out[target] += weight * abs(amount)
    out.update(table["shapes"][values["shape"]])
    return {target: round(min(weight, 1.0), 4) for target, weight in out.items() if weight > 5e-4}


def _between(amount: float, what: str) -> list[tuple[str, float]]:
    """Return the two targets that an amount -1..1 lies between, with their weights."""
    end = f"{'max' if amount > 0 else 'min'}{what}"
    return [(f"average{what}", 1 - abs(amount)), (end, abs(amount))]


def _colours(values: Mapping[str, Any]) -> dict[str, list[float]]:
    table = toml_table("person.toml")
    tones = np.array(table["skin"]["tones"], float)
    tone = values["skin"] * (len(tones) - 1)
    skin = np.array([np.interp(tone, np.arange(len(tones)), channel) for channel in tones.T])
    aged = _share(values["age"], YOUNG, OLD)

    def mixed(pair: Any, share: float) -> Any:
        first, second = np.array(pair, float)
        return first + share * (second - first)

    out = {"skin": skin, "pupil": np.array([12.0, 10.0, 10.0])}
    for name in ("blush", "lips", "corner"):
        out[name] = skin * mixed(table["skin"][name], values["skin"])
    for name, pair in table["mouth"].items():
        out[name] = mixed(pair, aged)
    hair = np.array(table["hair_colours"][values["hair"]]["colour"], float)
    out |= {"hair": hair, "brows": 0.82 * hair + 4, "lashes": 0.35 * hair + 10}
    names = ("iris_inner", "iris_middle", "iris_outer", "ring")
    out |= dict(zip(names, table["eye_colours"][values["eyes"]]["colours"], strict=True))
    shirts = table["shirts"]["colours"]
    out["shirt"] = shirts[round(values["age"] * 7 + values["skin"] * 31) % len(shirts)]
    return {name: [float(c) for c in np.rint(np.clip(colour, 0, 255))] for name, colour in out.items()}


SPREAD = 0.38  # standard deviation of a slider; faces of real people are mostly near the middle
LARGEST = 0.8
# Mean and standard deviation of each people's skin tone, 0..1.
TONES = {"african": (0.72, 0.12), "asian": (0.30, 0.10), "caucasian": (0.14, 0.09)}
DARK = ("black", "darkbrown")  # colours of hair and eyes of nearly all people
STYLES = {"female": ("bun", "bob", "long", "short"), "male": ("short", "buzz", "receding", "rim")}


def random_person(seed: int) -> dict[str, Any]:
    """Return the tables `says`, `person`, `hair` and `look` of a random recipe."""
    rng = np.random.default_rng(seed)
    table = toml_table("person.toml")
    sex = "female" if rng.random() < 0.5 else "male"
    age = round(float(rng.triangular(20, 32, 78)))
    share = rng.dirichlet((0.35, 0.35, 0.35))
    people = {name: round(float(part), 2) for name, part in zip(TONES, share, strict=True) if part > 0.05}
    total = sum(people.values())
    tone = sum(part * rng.normal(*TONES[name]) for name, part in people.items()) / total
    fair = people.get("caucasian", 0.0) / total > 0.7
    person: dict[str, Any] = {
        "age": age,
        "sex": round(float(rng.beta(12, 2) if sex == "male" else rng.beta(2, 12)), 2),
        "people": people,
        "weight": round(float(np.clip(rng.normal(0, 0.35), -0.7, 0.9)), 2),
        "skin": round(float(np.clip(tone, 0, 1)), 3),
        "shape": str(rng.choice(list(table["shapes"]))),
        "hair": _drawn(rng, table["hair_colours"], fair),
        "eyes": _drawn(rng, table["eye_colours"], fair),
    }
    for name in table["sliders"]:
        person[name] = round(float(np.clip(rng.normal(0, SPREAD), -LARGEST, LARGEST)), 2)
    styles = STYLES[sex] if sex == "female" or age > 45 else STYLES[sex][:2]
    looks = {"freckles": round(float(rng.beta(1, 6)), 2) if fair else 0.0}
    # Brows are individual.
    shapes = (("gap", 0.0, 0.0012), ("arch", 0.0, 0.0010), ("hair", 1.0, 0.1), ("thick", 1.0, 0.12))
    for name, middle, spread in shapes:
        looks[f"brow_{name}"] = round(float(middle + spread * np.clip(rng.normal(), -2, 2)), 4)
    if sex == "male":
        looks["stubble"] = round(float(rng.uniform(0, 0.6)), 2)
    return {
        "says": f"{description_of(person)} with {person['hair']} hair, drawn with seed {seed}",
        "person": person,
        "hair": {"style": str(rng.choice(styles))},
        "look": looks,
    }


def _drawn(rng: np.random.Generator, colours: dict[str, Any], fair: bool) -> str:
    names = [name for name, row in colours.items() if row["likely"] and (fair or name in DARK)]
    likely = np.array([colours[name]["likely"] for name in names], float)
    return str(rng.choice(names, p=likely / likely.sum()))
