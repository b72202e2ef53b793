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
from realizer_studio.faces.skin.skin_atlas import EYES
from realizer_studio.faces.teeth import teeth

ORDER = (
    "skin", "left_eye", "right_eye", "upper_teeth", "lower_teeth", "tongue", "tears", "shirt", "glasses",
)  # fmt: skip
UNDER_HAIR = 0.02  # m inside the hairline from which the skin needs few vertices
MARGIN = 0.08  # m below the floor, where the body is first cut between triangles
# Metres from the middle of the closed lips (2.2): how far the biting edges lie behind it and above it.
# The jaw hangs a little at rest, so that the rows do not touch.
BITE = {"upper_teeth": (0.0068, -0.0008), "lower_teeth": (0.0098, -0.0014)}
RED_RINGS = 9  # rings of the lips, from inside to just beyond the border of the red
LOWER_ARCH = 0.0015  # m by which the lower arch is narrower at each side
# The tongue at rest: m from the biting edge of the lower teeth back to its tip, and down to it; its width
# relative to the arch.
TONGUE = 0.0088, 0.0055, 0.70
TIP = 0.55, 0.50  # share of its length where the tip begins; share of the width at its end

# m beside the middle of an eye; light of vertices that no lid covers; vertices of a running mean; the least
# share of the light in the middle that the sides get.
MIDDLE, LID, MEAN, SIDE_LIGHT = 0.004, 0.12, 9, 0.65


def assemble(person: Person, lips: Lips, lids: list[Lid], recipe: Recipe) -> list[Part]:
    """Return the parts in the order of a face's vertices, with baked occlusion and without hair.

    The skin, which comes first, has its broad colours; details are in its maps.
    """
    figure, palette = person.figure, recipe.colours
    at, n = figure.at, len(figure.at)
    points = {name: figure.point(name) for name in figure.points}
    body = Submesh.of_quads(figure.mesh.quads["body"], n)
    body = body.with_triangles((body.positions(at)[:, 1] > person.floor - MARGIN)[body.triangles].all(axis=1))
    body = body.clipped(body.positions(at)[:, 1] - person.floor)[0]
    appearance = appearance_of(recipe.look)
    dressed = clothing.under_collar(
        body.positions(at), points["2.1"], person.face, appearance.collar_low, appearance.collar_point
    )
    skin = body.clipped(0.012 - dressed)[0]
    # The edges along the lips are subdivided, because lips bend most.
    sources, index = skin.sources(), np.full(n, -1)
    index[sources[sources >= 0]] = np.flatnonzero(sources >= 0)
    skin = skin.threaded([index[ring].tolist() for ring in lips.rings[:RED_RINGS]])
    style = style_of(recipe.hair)
    scalp = Scalp(skin.positions(at), skin.triangles, points, style.line, style.rise)
    colours = skin_colours.paint_skin(figure, lips, [lid.rings for lid in lids], palette, appearance)
    tints = np.asarray(skin.mix @ colours)
    parts = [Part("skin", skin, skin.positions(at), skin.triangles, tints, np.zeros(len(tints)))]
    eyes = zip(("left_eye", "right_eye"), (29, 30), (1, -1), person.balls, strict=True)
    parts += [eyeball(name, *ball, EYES, dilation, side) for name, dilation, side, ball in eyes]
    parts += _teeth(person, recipe)
    parts += [_tongue(person, recipe), tears(figure, lids, person.balls, palette["corner"])]
    parts.append(clothing.shirt(body, at, dressed, palette["shirt"]))
    if (figures := glasses_of(recipe.glasses)) is not None:
        parts.append(
            glasses(figures, parts[0].vertices, list(person.balls), [points["10.1"], points["10.2"]])
        )
    parts = sorted(parts, key=lambda part: ORDER.index(part.name))
    _bake(parts)
    stays = np.zeros(n, bool)
    stays[list(figure.points.values())] = True
    stays[lips.fade > 0.5] = True
    parts = [_decimate_hidden(part, person, scalp, stays) for part in parts]
    _line_mouth(parts[0], person, lips)
    return parts


def _line_mouth(skin: Part, person: Person, lips: Lips) -> None:
    assert skin.occlusion is not None
    deep = person.figure.point("2.2")[2] - skin.vertices[:, 2]
    # The lining right behind the corners stays dark, because a little of it shows beside closed lips.
    corners = smooth(np.abs(lips.u), 0.70, 0.92) * smooth(lips.fade, 0.45, 0.75)
    share = skin.submesh.mix @ (lips.inside * (1 - corners))
    skin_colours.light_mouth(skin.occlusion, share, deep)


def _decimate_hidden(part: Part, person: Person, scalp: Scalp, stays: Bool) -> Part:
    """Decimate hidden and even surfaces; feature points, lips and the lining of the mouth stay."""
    if part.name not in ("skin", "shirt") or part.patch is None:
        return part
    sources = part.patch.sources()
    keep = (sources >= 0) & stays[sources]
    chin = float(person.figure.point("2.1")[1])
    even = (scalp.ear_distance(part.vertices) < 0) | (scalp.high(part.vertices) > UNDER_HAIR)
    return clothing.decimate_hidden(part, keep, even, chin, person.floor)


def _teeth(person: Person, recipe: Recipe) -> list[Part]:
    bite = person.figure.point("2.2")
    width, depth = person.arch
    arches = []
    for name, (back, rise) in BITE.items():
        front = np.array([0, bite[1] + rise, bite[2] - back])
        narrow = LOWER_ARCH if name == "lower_teeth" else 0
        arches.append(teeth(name, front, width - narrow, depth, recipe.colours))
    return arches


def _tongue(person: Person, recipe: Recipe) -> Part:
    figure = person.figure
    tongue = Submesh.of_quads(figure.mesh.quads["helper-tongue"], len(figure.at))
    back, drop, wide = TONGUE
    bite, rest = figure.point("2.2"), tongue.positions(figure.at)
    edge = np.array([0, bite[1] + BITE["lower_teeth"][1] - drop, bite[2] - BITE["lower_teeth"][0] - back])
    fit = rest + edge - figure.point("6.1")
    along = (fit[:, 2] - fit[:, 2].min()) / np.ptp(fit[:, 2])
    begin, least = TIP
    narrow = np.sqrt(1 - (1 - least**2) * (np.maximum(along - begin, 0) / (1 - begin)) ** 2)
    fit[:, 0] = rest[:, 0] * narrow * wide * person.arch[0] / np.abs(rest[:, 0]).max()
    tongue = tongue.moved(fit - rest)
    positions = tongue.positions(figure.at)
    # The tongue is darker in its middle groove and at the sides.
    across = np.abs(positions[:, 0]) / np.abs(positions[:, 0]).max()
    shade = 1 - 0.30 * smooth(across, 0.14, 0.0) - 0.35 * smooth(across, 0.55, 1.0)
    colours: Float64 = np.array(recipe.colours["tongue"], float) * shade[:, None]
    # Little light reaches the back of the tongue.
    lit = along**1.5
    colours *= 0.60 + 0.40 * lit[:, None]
    light = 0.08 + 0.66 * lit
    moves = opening_rows(positions, person.jaw_pivot, np.interp(along, (0, 1), SINKS))
    moves |= tongue_bends(positions, along, np.ones(len(positions)))[2]
    gloss = np.full(len(positions), 0.35)
    return Part("tongue", tongue, positions, tongue.triangles, colours, gloss, light, moves)


def _bake(parts: list[Part]) -> None:
    """Bake the occlusion of the parts that have none; other parts cast no shadow."""
    lit = [part for part in parts if part.occlusion is None]
    count = np.cumsum([0] + [len(part.vertices) for part in lit])
    vertices = np.concatenate([part.vertices for part in lit])
    normals = np.concatenate([vertex_normals(part.vertices, part.triangles) for part in lit])
    blockers = np.concatenate([part.triangles + first for part, first in zip(lit, count, strict=False)])
    visible_sky = skin_colours.occlusion(vertices, normals, blockers)
    for part, first in zip(lit, count, strict=False):
        light = 0.25 + 0.75 * visible_sky[first : first + len(part.vertices)]
        # Eyes get less light than other cavities, because the walls around them are not pale.
        part.occlusion = _lit_sideways(part, light**3) if part.name in ("left_eye", "right_eye") else light


def _lit_sideways(eye: Part, light: Float64) -> Float64:
    """Return the light on an eye, with lighter sides, which are visible when the eye turns.

    Lids follow the eye up and down, but not to the sides: there the eye is at most a little darker than in
    its middle at the same height.
    """
    offset = eye.vertices - eye.vertices.mean(axis=0)
    middle = np.flatnonzero((np.abs(offset[:, 0]) < MIDDLE) & (offset[:, 2] > 0) & (light > LID))
    middle = middle[np.argsort(offset[middle, 1])]
    row = np.convolve(np.pad(light[middle], MEAN // 2, mode="edge"), np.ones(MEAN) / MEAN, "valid")
    return np.asarray(np.maximum(light, SIDE_LIGHT * np.interp(offset[:, 1], offset[middle, 1], row)))
