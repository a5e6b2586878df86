#!/usr/bin/env python3
"""Build the documentation site into build/site/html; warnings are errors, and no network is needed to read it.

python3 scripts/make_site.py          build what has changed since the last time
python3 scripts/make_site.py --fresh  build everything
"""

import argparse
import re
import shutil
import subprocess
import sys
from pathlib import Path

import bootstrap

bootstrap.enter("test")

SITE = bootstrap.ROOT / "build" / "site"
SOURCE, HTML = SITE / "source", SITE / "html"

# Of the root of the repository, and what the site calls them
PAGES = {"CHANGELOG.md": "changelog.md", "CONTRIBUTING.md": "contributing.md", "SECURITY.md": "security.md"}


def copy_sources() -> None:
    """Copy docs/ and some pages of the root, whose links are made to fit, without touching what has not changed."""
    wanted = {
        path.relative_to(bootstrap.ROOT / "docs"): path.read_bytes() for path in files_of(bootstrap.ROOT / "docs")
    }
    for name, page in PAGES.items():
        text = (bootstrap.ROOT / name).read_text(encoding="utf-8")
        wanted[Path(page)] = text.replace("](docs/", "](").encode()
    for place, content in wanted.items():
        if place.suffix == ".md":
            content = link_pages(content.decode()).encode()
        target = SOURCE / place
        if not target.exists() or target.read_bytes() != content:
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(content)
    for path in files_of(SOURCE):
        place = path.relative_to(SOURCE)
        if place not in wanted and place.parts[0] not in ("auto_gallery", "api", "jupyter_execute"):
            path.unlink()


def files_of(folder: Path) -> "list[Path]":
    return [path for path in folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts]


def link_pages(text: str) -> str:
    """Links to pages of the root lead to those of the site."""
    for name, page in PAGES.items():
        text = re.sub(rf"\]\((?:\.\./)?{re.escape(name)}\)", f"]({page})", text)
    return text


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fresh", action="store_true", help="build everything anew")
    if parser.parse_args().fresh:
        shutil.rmtree(SITE, ignore_errors=True)
    copy_sources()
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html", "-d", str(SITE / "doctrees")]
    code = subprocess.call([*command, str(SOURCE), str(HTML)], cwd=SITE)
    remote = find_remote(HTML)
    for line in remote:
        print(f"needs a network: {line}")
    if code == 0 and not remote:
        print(f"the site: {HTML / 'index.html'}")
    return code or bool(remote)


def find_remote(folder: Path) -> "list[str]":
    """What pages load from elsewhere: scripts, styles and pictures; links to other sites are none."""
    loads = re.compile(
        r"""<(?:script|img|iframe|source)[^>]*\ssrc=["']https?:[^"']*|<link[^>]*stylesheet[^>]*https?:[^"']*"""
    )
    return [
        f"{page.relative_to(folder)}: {found}"
        for page in folder.rglob("*.html")
        for found in loads.findall(page.read_text(encoding="utf-8"))
    ]


if __name__ == "__main__":
    sys.exit(main())
