"""The assembly of a person's bust from parts, with baked ambient occlusion."""

import numpy as np

from realizer.core.array_types import Bool, Float64
from realizer.face.mesh_geometry import vertex_normals
from realizer_studio.faces.eyeball import eyeball
from realizer_studio.faces.hair.style import style_of
from realizer_studio.faces.mpeg4.rigid import opening_rows, tongue_bends
from realizer_studio.faces.parts import Part, Submesh, smooth
from realizer_studio.faces.person import clothing, skin_colours
from realizer_studio.faces.person.clothing import glasses, glasses_of
from realizer_studio.faces.person.fap_fields import SINKS
from realizer_studio.faces.person.lids import Lid, tears
from realizer_studio.faces.person.lips import Lips
from realizer_studio.faces.person.person import Person
from realizer_studio.faces.person.recipe import Recipe, appearance_of
from realizer_studio.faces.person.scalp import Scalp
from realizer_studio.faces.skin.atlas import EYES
from realizer_studio.faces.teeth import teeth

ORDER = (
    "skin", "left_eye", "right_eye", "upper_teeth", "lower_teeth", "tongue", "tears", "shirt", "glasses",
)  # fmt: skip
UNDER_HAIR = 0.02  # m inside the hairline from which the skin needs few vertices
MARGIN = 0.08  # m below the floor that the body is cut at by whole triangles first
# Metres from the middle of the closed lips (2.2): how far the biting edges lie behind it and above it.
# A resting jaw hangs a little: the rows do not touch.
BITE = {"upper_teeth": (0.0068, -0.0008), "lower_teeth": (0.0098, -0.0014)}
RED_RINGS = 9  # of the lips' rings, from inside to just beyond the border of the red
LOWER_ARCH = 0.0015  # m that the lower arch is narrower at each side
# The tongue at rest: m that its tip lies behind the biting edge of the lower teeth, and below it; half its
# width in half widths of the arch.
TONGUE = 0.0088, 0.0055, 0.70
TIP = 0.55, 0.50  # from that share of its length on it gets round; its tip has this share of the width

# m beside the middle of an eye, and the light from which it is no lid's; places that a mean there is of; the
# least share of that light at the sides.
MIDDLE, LID, MEAN, ASIDE = 0.004, 0.12, 9, 0.65


def assemble(person: Person, lips: Lips, lids: list[Lid], recipe: Recipe) -> list[Part]:
    """Return the parts in the order of a face's vertices, with baked occlusion; hair grows on them later.

    The skin, which comes first, has only its broad colours: the rest is in its maps.
    """
    ground, look = person.ground, recipe.colours
    at, n = ground.at, len(ground.at)
    points = {name: ground.point(name) for name in ground.points}
    body = Submesh.of_quads(ground.mesh.quads["body"], n)
    body = body.with_triangles((body.positions(at)[:, 1] > person.floor - MARGIN)[body.triangles].all(axis=1))
    body = body.clipped(body.positions(at)[:, 1] - person.floor)[0]
    appearance = appearance_of(recipe.look)
    dressed = clothing.under_collar(
        body.positions(at), points["2.1"], person.face, appearance.collar_low, appearance.collar_point
    )
    skin = body.clipped(0.012 - dressed)[0]
    # A vertex more between any two along the lips: they bend most.
    own, place = skin.sources(), np.full(n, -1)
    place[own[own >= 0]] = np.flatnonzero(own >= 0)
    skin = skin.threaded([place[ring].tolist() for ring in lips.rings[:RED_RINGS]])
    style = style_of(recipe.hair)
    scalp = Scalp(skin.positions(at), skin.triangles, points, style.line, style.rise)
    colours = skin_colours.paint_skin(ground, lips, [lid.rings for lid in lids], look, appearance)
    tints = np.asarray(skin.mix @ colours)
    made = [Part("skin", skin, skin.positions(at), skin.triangles, tints, np.zeros(len(tints)))]
    eyes = zip(("left_eye", "right_eye"), (29, 30), (1, -1), person.balls, strict=True)
    made += [eyeball(name, *ball, EYES, dilation, side) for name, dilation, side, ball in eyes]
    made += _teeth(person, recipe)
    made += [_tongue(person, recipe), tears(ground, lids, person.balls, look["corner"])]
    made.append(clothing.shirt(body, at, dressed, look["shirt"]))
    if (figures := glasses_of(recipe.glasses)) is not None:
        made.append(glasses(figures, made[0].vertices, list(person.balls), [points["10.1"], points["10.2"]]))
    made = sorted(made, key=lambda part: ORDER.index(part.name))
    _bake(made)
    stays = np.zeros(n, bool)
    stays[list(ground.points.values())] = True
    stays[lips.fade > 0.5] = True
    made = [_decimate_hidden(part, person, scalp, stays) for part in made]
    _line_mouth(made[0], person, lips)
    return made


def _line_mouth(skin: Part, person: Person, lips: Lips) -> None:
    assert skin.occlusion is not None
    deep = person.ground.point("2.2")[2] - skin.vertices[:, 2]
    # Right behind the corners it stays dark: seen from the side, closed lips show a hair of it.
    corners = smooth(np.abs(lips.u), 0.70, 0.92) * smooth(lips.fade, 0.45, 0.75)
    share = skin.submesh.mix @ (lips.inside * (1 - corners))
    skin_colours.light_mouth(skin.occlusion, share, deep)


def _decimate_hidden(part: Part, person: Person, scalp: Scalp, stays: Bool) -> Part:
    """Decimate hidden and plain surface; feature points, lips and the mouth behind them stay."""
    if part.name not in ("skin", "shirt") or part.patch is None:
        return part
    own = part.patch.sources()
    keep = (own >= 0) & stays[own]
    chin = float(person.ground.point("2.1")[1])
    plain = (scalp.off_ear(part.vertices) < 0) | (scalp.high(part.vertices) > UNDER_HAIR)
    return clothing.decimate_hidden(part, keep, plain, chin, person.floor)


def _teeth(person: Person, recipe: Recipe) -> list[Part]:
    bite = person.ground.point("2.2")
    width, depth = person.arch
    made = []
    for name, (back, rise) in BITE.items():
        front = np.array([0, bite[1] + rise, bite[2] - back])
        narrow = LOWER_ARCH if name == "lower_teeth" else 0
        made.append(teeth(name, front, width - narrow, depth, recipe.colours))
    return made


def _tongue(person: Person, recipe: Recipe) -> Part:
    ground = person.ground
    tongue = Submesh.of_quads(ground.mesh.quads["helper-tongue"], len(ground.at))
    back, drop, wide = TONGUE
    bite, rest = ground.point("2.2"), tongue.positions(ground.at)
    edge = np.array([0, bite[1] + BITE["lower_teeth"][1] - drop, bite[2] - BITE["lower_teeth"][0] - back])
    fit = rest + edge - ground.point("6.1")
    along = (fit[:, 2] - fit[:, 2].min()) / np.ptp(fit[:, 2])
    begin, least = TIP
    narrow = np.sqrt(1 - (1 - least**2) * (np.maximum(along - begin, 0) / (1 - begin)) ** 2)
    fit[:, 0] = rest[:, 0] * narrow * wide * person.arch[0] / np.abs(rest[:, 0]).max()
    tongue = tongue.moved(fit - rest)
    place = tongue.positions(ground.at)
    # Darker in the groove along the middle and at the sides.
    across = np.abs(place[:, 0]) / np.abs(place[:, 0]).max()
    shade = 1 - 0.30 * smooth(across, 0.14, 0.0) - 0.35 * smooth(across, 0.55, 1.0)
    colours: Float64 = np.array(recipe.colours["tongue"], float) * shade[:, None]
    # An open mouth is dark behind: little light reaches the tongue's back.
    lit = along**1.5
    colours *= 0.60 + 0.40 * lit[:, None]
    light = 0.08 + 0.66 * lit
    moves = opening_rows(place, person.jaw_pivot, np.interp(along, (0, 1), SINKS))
    moves |= tongue_bends(place, along, np.ones(len(place)))[2]
    gloss = np.full(len(place), 0.35)
    return Part("tongue", tongue, place, tongue.triangles, colours, gloss, light, moves)


def _bake(made: list[Part]) -> None:
    """Bake the occlusion of the parts that have none; all others cast no shadow."""
    lit = [part for part in made if part.occlusion is None]
    count = np.cumsum([0] + [len(part.vertices) for part in lit])
    vertices = np.concatenate([part.vertices for part in lit])
    ups = np.concatenate([vertex_normals(part.vertices, part.triangles) for part in lit])
    casts = np.concatenate([part.triangles + first for part, first in zip(lit, count, strict=False)])
    sees = skin_colours.occlusion(vertices, ups, casts)
    for part, first in zip(lit, count, strict=False):
        light = 0.25 + 0.75 * sees[first : first + len(part.vertices)]
        # The drawn light comes back from pale walls of a cavity, but those around eyes are not pale.
        part.occlusion = _beside_lids(part, light**3) if part.name in ("left_eye", "right_eye") else light


def _beside_lids(eye: Part, light: Float64) -> Float64:
    """Return the light on an eye, of which lids and corners hide parts that are seen when it turns.

    Up and down the lids go with the eye. To the sides they do not: there it gets little darker than in its
    middle at the same height.
    """
    away = eye.vertices - eye.vertices.mean(axis=0)
    middle = np.flatnonzero((np.abs(away[:, 0]) < MIDDLE) & (away[:, 2] > 0) & (light > LID))
    middle = middle[np.argsort(away[middle, 1])]
    row = np.convolve(np.pad(light[middle], MEAN // 2, mode="edge"), np.ones(MEAN) / MEAN, "valid")
    return np.asarray(np.maximum(light, ASIDE * np.interp(away[:, 1], away[middle, 1], row)))
