"""A head of three balls, for tests that draw."""

from __future__ import annotations

import functools

import numpy as np

from realizer.face.model import Face, Fapu


def ball(centre: tuple[float, float, float], radii: tuple[float, float, float], rings: int):
    """Vertices, unit directions and triangles of an ellipsoid, counter-clockwise seen from outside."""
    around = 2 * rings
    down, turn = np.meshgrid(
        np.linspace(0, np.pi, rings), np.linspace(0, 2 * np.pi, around, endpoint=False), indexing="ij"
    )
    ups = np.stack([np.sin(down) * np.sin(turn), np.cos(down), np.sin(down) * np.cos(turn)], -1).reshape(
        -1, 3
    )
    ring, step = np.meshgrid(np.arange(rings - 1), np.arange(around), indexing="ij")
    a, b = (ring * around + step).ravel(), (ring * around + (step + 1) % around).ravel()
    triangles = np.concatenate([np.stack([a, a + around, b], 1), np.stack([b, a + around, b + around], 1)])
    return np.asarray(centre) + ups * np.asarray(radii), ups, triangles


@functools.cache
def face_of_balls() -> tuple[Face, np.ndarray]:
    """A face that knows no FAP, and its normals: an egg of a head with two white eyes."""
    solids = [
        (ball((0, -0.03, -0.09), (0.075, 0.115, 0.09), 40), (206, 158, 132), 0.1),
        (ball((0.032, 0.0, -0.015), (0.013,) * 3, 24), (240, 240, 240), 1.0),
        (ball((-0.032, 0.0, -0.015), (0.013,) * 3, 24), (240, 240, 240), 1.0),
    ]
    vertices, normals, triangles, colours, gloss, parts, first = [], [], [], [], [], {}, 0
    for name, ((points, ups, faces), colour, shine) in zip(
        ("skin", "left_eye", "right_eye"), solids, strict=True
    ):
        vertices.append(points)
        normals.append(ups)
        triangles.append(faces + first)
        colours.append(np.tile(colour, (len(points), 1)))
        gloss.append(np.full(len(points), shine))
        parts[name] = (first, first + len(points))
        first += len(points)
    face = Face(
        name="balls",
        source="made for tests",
        licence="MIT",
        vertices=np.concatenate(vertices).astype(np.float32),
        triangles=np.concatenate(triangles).astype(np.int32),
        colours=np.concatenate(colours).astype(np.uint8),
        occlusion=np.ones(first, np.float32),
        gloss=np.concatenate(gloss).astype(np.float32),
        parts=parts,
        feature_points={"2.1": 0, "11.1": 0},
        points={
            "2.1": np.array([0, -0.12, -0.03], np.float32),
            "11.1": np.array([0, 0.06, -0.02], np.float32),
        },
        fapu=Fapu(0.012, 0.064, 0.05, 0.03, 0.05),
        basis={},
    )
    return face, np.concatenate(normals).astype(np.float32)
