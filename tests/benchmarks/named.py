"""Classifies the emotions of our faces with a recogniser that was trained on photographs of people.

npm install --prefix FOLDER @vladmandic/face-api@1.7.15
python tests/benchmarks/named.py FOLDER [--face NAME ...] [--chromium PATH] [-o PICTURE]

The network (MIT licence) runs in Chromium. Each face shows each of the six emotions at full intensity from
the front; the program prints the three most probable names. The network was trained on photographs, few of
which show disgust, so its names are only a second opinion.
"""

from __future__ import annotations

import argparse
import base64
import io
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from PIL import Image
from playwright.sync_api import Page, Route, sync_playwright

from realizer.animation.axis import au, axis
from realizer.animation.frames import AUFrames
from realizer.animation.pose import poses
from realizer.face.fap_mapping import mapping_of
from realizer.face.load import load_face
from realizer.render.renderer import Renderer
from realizer.tables.cooccurrence import rules
from realizer.tables.lexemes import face_lexemes

NAMES = {
    "ANGER": "angry",
    "DISGUST": "disgusted",
    "FEAR": "fearful",
    "HAPPINESS": "happy",
    "SADNESS": "sad",
    "SURPRISE": "surprised",
}
PACKAGE = Path("node_modules", "@vladmandic", "face-api")
SIZE = 320
HOST = "http://recogniser.invalid/"
START = """async (models) => {
  await faceapi.tf.setBackend("cpu"); await faceapi.tf.ready();
  for (const net of ["tinyFaceDetector", "faceLandmark68Net", "faceExpressionNet"])
    await faceapi.nets[net].loadFromUri(models);
}"""
NAME = """async (source) => {
  const image = new Image(); image.src = source; await image.decode();
  const options = new faceapi.TinyFaceDetectorOptions({inputSize: 224, scoreThreshold: 0.1});
  const found = await faceapi.detectSingleFace(image, options).withFaceLandmarks().withFaceExpressions();
  return found ? found.expressions : {};
}"""


def pictures(name: str) -> list[Image.Image]:
    """Return pictures of the six emotions on a face, SIZE x SIZE each."""
    values = np.zeros((len(NAMES), len(axis())), np.float32)
    for row, lexeme in zip(values, NAMES, strict=True):
        for (number, side), value in face_lexemes()[lexeme].aus.items():
            row[[target.column for target in au(number, side)]] = value
    frames = AUFrames(np.arange(len(NAMES), dtype=np.float64), values, rules())
    shown = poses(frames, load_face(name).inputs, mapping_of(name))
    with Renderer(name, (SIZE, SIZE), "front") as renderer:
        return [Image.fromarray(np.asarray(image)[..., :3]) for image in renderer.draw(shown)]


@contextmanager
def recogniser(folder: Path, chromium: str | None) -> Iterator[Page]:
    """Open a page of Chromium with the network, whose files come from the folder."""

    def serve(route: Route) -> None:
        file = folder / PACKAGE / route.request.url.removeprefix(HOST)
        if route.request.url == HOST:
            route.fulfill(body="<!doctype html>", content_type="text/html")
        elif file.is_file():
            route.fulfill(path=file)
        else:
            route.fulfill(status=404)

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = browser.new_page()
        page.route("**/*", serve)
        page.goto(HOST)
        page.add_script_tag(url=f"{HOST}dist/face-api.js")
        page.evaluate(START, f"{HOST}model")
        yield page
        browser.close()


def classify(page: Page, picture: Image.Image) -> dict[str, float]:
    """Return name -> probability, the most probable first; {} if the network finds no face."""
    file = io.BytesIO()
    picture.save(file, "PNG")
    source = f"data:image/png;base64,{base64.b64encode(file.getvalue()).decode()}"
    found: dict[str, float] = page.evaluate(NAME, source)
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def main() -> None:
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("folder", type=Path, help="where npm installed the network")
    options.add_argument("--face", nargs="*", default=["ada", "ben", "ida"])
    options.add_argument("--chromium", help="another Chromium than playwright's")
    options.add_argument("-o", "--output", type=Path, help="the pictures, faces below each other")
    chosen = options.parse_args()
    if not (chosen.folder / PACKAGE).is_dir():
        sys.exit(f"{chosen.folder}: no {PACKAGE} there; see --help for how to install it")
    sheet = Image.new("RGB", (SIZE * len(NAMES), SIZE * len(chosen.face)))
    right = 0
    with recogniser(chosen.folder, chosen.chromium) as page:
        for line, face in enumerate(chosen.face):
            for column, ((lexeme, expected), picture) in enumerate(
                zip(NAMES.items(), pictures(face), strict=True)
            ):
                sheet.paste(picture, (SIZE * column, SIZE * line))
                names = list(classify(page, picture).items())[:3]
                right += bool(names) and names[0][0] == expected
                result = ", ".join(f"{name} {probability:.2f}" for name, probability in names) or "no face"
                print(f"{face:4} {lexeme:10} {result}", flush=True)
    print(f"recognised: {right} of {len(NAMES) * len(chosen.face)}")
    if chosen.output:
        sheet.save(chosen.output)


if __name__ == "__main__":
    main()
