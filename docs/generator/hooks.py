"""Hooks of mkdocs: add generated pages and files of other folders, and make their links work.

In the repository, links lead to files: `../faces/README.md`. On the site, a file of another folder is a page
below project/, or, if it is not on the site, a link into the repository. As long as the repository has no
address (`[project.urls]` in pyproject.toml), its name remains without a link.
"""

from __future__ import annotations

import posixpath
import re
import sys
import tomllib
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))
# Files of other folders that are pages or pictures of the site.
OTHERS = (
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "bml_schema/CONFORMANCE.md",
    "clients/javascript/README.md",
    "docker/README.md",
    "examples/README.md",
    "faces/README.md",
    "realizer/examples/faces.png",
    "realizer/examples/greeting.png",
    "realizer/examples/page.png",
    "realizer/examples/schedule.svg",
    "realizer/examples/speaking.webp",
)
LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s]+)\)")
DIAGRAM = re.compile(r"```mermaid\n.*?^```$", re.DOTALL | re.MULTILINE)
FENCE = re.compile(r"(^```.*?^```$)", re.DOTALL | re.MULTILINE)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that are made, and the files of other folders."""
    from docs.generator.pages import PAGES
    from docs.generator.states import drawing

    for name, make in PAGES.items():
        for path, content in make().items():
            files.append(File.generated(config, f"generated/{path}", content=content))
        assert files.get_file_from_path(f"generated/{name}.md")
    files.append(File.generated(config, "generated/states.svg", content=drawing()))
    for name in OTHERS:
        files.append(File.generated(config, f"project/{name}", abs_src_path=str(ROOT / name)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Point the links of a page to pages of the site, or into the repository; draw the states."""
    uri = page.file.src_uri
    if uri == "blocks.md":  # to draw it, a page would need a third-party script
        markdown = DIAGRAM.sub("![The states of a block](generated/states.svg)", markdown)
    here = posixpath.dirname(uri.removeprefix("project/") if uri.startswith("project/") else f"docs/{uri}")

    def link(match: re.Match[str]) -> str:
        mark, text, target = match.groups()
        path, hash, anchor = target.partition("#")
        if "://" in target or not path or path.startswith("mailto:"):
            return match[0]
        wanted = posixpath.normpath(posixpath.join(here, path))
        site = wanted.removeprefix("docs/") if wanted.startswith("docs/") else f"project/{wanted}"
        if files.get_file_from_path(site) is None and not wanted.startswith("docs/"):
            address = repository()
            return f"[{text}]({address}/blob/main/{wanted}{hash}{anchor})" if address else text
        relative = posixpath.relpath(site, posixpath.dirname(uri) or ".")
        return f"{mark}[{text}]({relative}{hash}{anchor})"

    parts = FENCE.split(markdown)
    return "".join(part if part.startswith("```") else LINK.sub(link, part) for part in parts)


def repository() -> str:
    """Return the address of the repository, or "" as long as there is none."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    return str(project.get("urls", {}).get("Repository", "")).rstrip("/")
