"""Counts how often two recognisers of emotions in photographs name those of our faces as meant.

npm install --prefix FOLDER \\
    @vladmandic/face-api@1.7.15 @vladmandic/human@3.3.6 @tensorflow/tfjs-backend-wasm@4.22.0
python benchmarks/named.py FOLDER [--quick] [--face NAME ...] [--chromium PATH] [-o PICTURE]

The networks (MIT licence, settings of their authors) run in Chromium. Each face is neutral and shows each of
the six emotions at full intensity, from the front and turned by 20 degrees to either side, in three lights;
`--quick` leaves the front in the first light. For each network the program prints how many pictures of each
face and emotion it names as meant, and its most frequent wrong name. Few photographs that networks learn from
show disgust (1.5 % of FER2013, which is `human`'s), so their names are only a second opinion.
"""

from __future__ import annotations

import argparse
import base64
import io
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import product
from pathlib import Path

import numpy as np
from PIL import Image
from playwright.sync_api import Page, Route, sync_playwright

from realizer.animation.axis import au, axis
from realizer.animation.frames import AUFrames
from realizer.animation.pose import poses
from realizer.face.fap_mapping import mapping_of
from realizer.face.load import list_faces, load_face
from realizer.render.renderer import Renderer
from realizer.tables import by_number
from realizer.tables.cooccurrence import rules
from realizer.tables.lexemes import face_lexemes

# Lexeme -> its names in the networks.
NAMES = {
    "NEUTRAL": ("neutral",),
    "ANGER": ("angry",),
    "DISGUST": ("disgusted", "disgust"),
    "FEAR": ("fearful", "fear"),
    "HAPPINESS": ("happy",),
    "SADNESS": ("sad",),
    "SURPRISE": ("surprised", "surprise"),
}
PACKAGES = ("@vladmandic/face-api", "@vladmandic/human", "@tensorflow/tfjs-backend-wasm")
NETWORKS = ("face-api", "human")
TURNS = (0.0, 20.0, -20.0)  # degrees to the character's left
LIGHTS = ("portrait", "daylight", "evening")
LEFT, RIGHT = 51, 52  # action units that turn the head
SIZE = 320
HOST = "http://recogniser.invalid/"
START = """async ([faces, human, wasm]) => {
  faceapi.tf.setWasmPaths(wasm); await faceapi.tf.setBackend("wasm"); await faceapi.tf.ready();
  for (const net of ["tinyFaceDetector", "faceLandmark68Net", "faceExpressionNet"])
    await faceapi.nets[net].loadFromUri(faces);
  const off = { enabled: false }, always = { skipFrames: 0, skipTime: 0 };
  window.human = new Human.Human({
    backend: "wasm", wasmPath: wasm, modelBasePath: human, cacheSensitivity: 0,
    hand: off, body: off, object: off, gesture: off, segmentation: off,
    face: { detector: { maxDetected: 1, minConfidence: 0.1, ...always }, iris: off, description: off,
            emotion: { minConfidence: 0, ...always } },
  });
  await window.human.load();
}"""
NAME = """async (source) => {
  const image = new Image(); image.src = source; await image.decode();
  const options = new faceapi.TinyFaceDetectorOptions({ inputSize: 224, scoreThreshold: 0.1 });
  const found = await faceapi.detectSingleFace(image, options).withFaceLandmarks().withFaceExpressions();
  const first = Object.entries(found?.expressions ?? {}).sort((a, b) => b[1] - a[1])[0];
  const { face } = await window.human.detect(image);
  return [first?.[0] ?? "no face", face[0]?.emotion[0]?.emotion ?? "no face"];
}"""


def pictures(name: str, light: str, turn: float) -> list[Image.Image]:
    """Return pictures of a face for each of NAMES, SIZE x SIZE each."""
    values = np.zeros((len(NAMES), len(axis())), np.float32)
    for row, lexeme in zip(values, NAMES, strict=True):
        shown = dict(face_lexemes()[lexeme].aus) if lexeme in face_lexemes() else {}
        side = LEFT if turn > 0 else RIGHT
        shown[side, "BOTH"] = abs(turn) / (by_number()[side].degrees or 1.0)
        for (number, part), value in shown.items():
            row[[target.column for target in au(number, part)]] = min(value, 1.0)
    frames = AUFrames(np.arange(len(NAMES), dtype=np.float64), values, rules())
    posed = poses(frames, load_face(name).inputs, mapping_of(name))
    with Renderer(name, (SIZE, SIZE), "front", light=light) as renderer:
        return [Image.fromarray(np.asarray(image)[..., :3]) for image in renderer.draw(posed)]


@contextmanager
def recognisers(folder: Path, chromium: str | None) -> Iterator[Page]:
    """Open a page of Chromium with the networks, whose files come from the folder."""

    def serve(route: Route) -> None:
        file = folder / "node_modules" / route.request.url.removeprefix(HOST)
        if route.request.url == HOST:
            route.fulfill(body="<!doctype html>", content_type="text/html")
        elif file.is_file():
            route.fulfill(path=file)
        else:
            route.fulfill(status=404)

    faces, human, wasm = (f"{HOST}{package}" for package in PACKAGES)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = browser.new_page()
        page.route("**/*", serve)
        page.goto(HOST)
        page.add_script_tag(url=f"{faces}/dist/face-api.js")
        page.add_script_tag(url=f"{human}/dist/human.js")
        page.evaluate(START, [f"{faces}/model", f"{human}/models/", f"{wasm}/dist/"])
        yield page
        browser.close()


def named(page: Page, picture: Image.Image) -> list[str]:
    """Return the most probable name by each of NETWORKS; "no face" if it finds none."""
    file = io.BytesIO()
    picture.save(file, "PNG")
    source = f"data:image/png;base64,{base64.b64encode(file.getvalue()).decode()}"
    names: list[str] = page.evaluate(NAME, source)
    return names


def report(network: str, given: dict[tuple[str, str], list[str]], faces: list[str]) -> None:
    """Print a row for each face, and one for all; `given` has the names for (face, lexeme)."""
    print(f"\n{network:9}" + "".join(f"{lexeme.lower():>17}" for lexeme in NAMES) + "        all")
    for face in [*faces, "all"]:
        right = total = 0
        line = f"{face:9}"
        for lexeme, meant in NAMES.items():
            names = [name for f in faces if face in (f, "all") for name in given[f, lexeme]]
            good = sum(name in meant for name in names)
            wrong = Counter(name for name in names if name not in meant).most_common(1)
            line += f"{f'{good}/{len(names)} {wrong[0][0] if wrong else str()}':>17}"
            right, total = right + good, total + len(names)
        print(f"{line}{right / total:>10.0%}")


def main() -> None:
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("folder", type=Path, help="where npm installed the networks")
    options.add_argument("--face", nargs="*", default=[info.name for info in list_faces()])
    options.add_argument("--quick", action="store_true", help="only from the front, in one light")
    options.add_argument("--chromium", help="another Chromium than playwright's")
    options.add_argument("-o", "--output", type=Path, help="the pictures, faces below each other")
    chosen = options.parse_args()
    for package in PACKAGES:
        if not (chosen.folder / "node_modules" / package).is_dir():
            sys.exit(f"{chosen.folder}: no {package} there; see --help for how to install it")
    views = [(LIGHTS[0], TURNS[0])] if chosen.quick else list(product(LIGHTS, TURNS))
    given: dict[str, dict[tuple[str, str], list[str]]] = {name: defaultdict(list) for name in NETWORKS}
    sheet = Image.new("RGB", (SIZE * len(NAMES), SIZE * len(chosen.face) * len(views)))
    with recognisers(chosen.folder, chosen.chromium) as page:
        for line, (face, (light, turn)) in enumerate(product(chosen.face, views)):
            for column, (lexeme, picture) in enumerate(zip(NAMES, pictures(face, light, turn), strict=True)):
                sheet.paste(picture, (SIZE * column, SIZE * line))
                for network, name in zip(NETWORKS, named(page, picture), strict=True):
                    given[network][face, lexeme].append(name)
            print(f"{face}, {light}, {turn:g} degrees", file=sys.stderr, flush=True)
    for network in NETWORKS:
        report(network, given[network], chosen.face)
    if chosen.output:
        sheet.save(chosen.output)


if __name__ == "__main__":
    main()
