"""Plausible people drawn at random, as recipes."""

from __future__ import annotations

from typing import Any

import numpy as np

from realizer.facebuild.person.sliders import description_of
from realizer.tables import toml_table

SPREAD = 0.38  # standard deviation of a slider; faces of real people are mostly near the middle
LARGEST = 0.8
# Where the skin of each people lies on the scale 0..1, with its standard deviation.
TONES = {"african": (0.72, 0.12), "asian": (0.30, 0.10), "caucasian": (0.14, 0.09)}
DARK = ("black", "darkbrown")  # colours of hair and eyes that nearly all people have
STYLES = {"female": ("bun", "bob", "long", "short"), "male": ("short", "buzz", "receding", "rim")}


def random_person(seed: int) -> dict[str, Any]:
    """Return the tables `says`, `person`, `hair` and `look` of a recipe; the same for the same seed."""
    rng = np.random.default_rng(seed)
    table = toml_table("person.toml")
    sex = "female" if rng.random() < 0.5 else "male"
    age = round(float(rng.triangular(20, 32, 78)))
    share = rng.dirichlet((0.35, 0.35, 0.35))
    people = {name: round(float(part), 2) for name, part in zip(TONES, share, strict=True) if part > 0.05}
    whole = sum(people.values())
    tone = sum(part * rng.normal(*TONES[name]) for name, part in people.items()) / whole
    fair = people.get("caucasian", 0.0) / whole > 0.7
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
    # No two people share their brows.
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
