#!/usr/bin/env python3
"""Every file and heading that a page links exists; every path in backticks exists; every page stands in the
contents of the book; what a page quotes of an example stands there."""

import fnmatch
import re
import subprocess
import sys

from markdown_pages import ROOT, file_of, name, pages, slugs, split

SOURCE_SUFFIX = (".h", ".cc", ".py", ".md", ".sh", ".lcm", ".eds", ".cff", ".toml")
# Files in backticks that a command makes, or a message names.
MADE = {"mine.toml", "scene.toml", "baselines.toml", "mantle_drive.eds"}
# Pages whose blocks of C++ are parts of an example.
QUOTES = {"docs/tutorials/own_controller.md": "examples/own_controller.cc"}


def repository_files():
    run = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard"], cwd=ROOT, text=True,
                         capture_output=True)
    if run.returncode == 0:
        return run.stdout.splitlines()
    return [path.relative_to(ROOT).as_posix() for path in ROOT.rglob("*")
            if path.is_file() and not path.relative_to(ROOT).parts[0].startswith(("build", "results", "."))]


def main():
    files = repository_files()
    folders = {"/".join(file.split("/")[:depth]) for file in files for depth in range(1, file.count("/") + 1)}
    tops = {file.split("/")[0] for file in files if "/" in file} - {"build"}
    base_names = {file.rsplit("/", 1)[-1] for file in files}
    targets = "\n".join((ROOT / file).read_text() for file in files if file.endswith(("CMakeLists.txt", ".cmake")))
    problems, links, paths = [], 0, 0
    texts = {page: page.read_text() for page in pages()}
    saved = {file_of(block)[0] for text in texts.values() for block in split(text)[0] if file_of(block)} | MADE

    for page, text in texts.items():
        _, prose = split(text)
        for number, line in enumerate(prose.splitlines(), 1):
            where = f"{name(page)}:{number}"
            for target in re.findall(r"\]\(([^)\s]+)\)", re.sub(r"`[^`]*`", "", line)):
                if re.match(r"[a-z]+:", target):
                    continue
                links += 1
                path, _, anchor = target.partition("#")
                linked = (page.parent / path).resolve() if path else page
                if not linked.exists():
                    problems.append(f"{where}: links {target}, which does not exist")
                elif anchor and anchor not in slugs(linked.read_text()):
                    problems.append(f"{where}: links {target}, which has no such heading")
            for span in re.findall(r"`([^`]+)`", line):
                for token in span.split():
                    token = token.strip(",;:").rstrip("/")
                    if not re.fullmatch(r"[\w.*/{},+-]+", token):
                        continue
                    top, slash, rest = token.partition("/")
                    if slash and top == "build" and re.fullmatch(r"\w+", rest):
                        paths += 1
                        if not re.search(rf"\b{rest}\b", targets):
                            problems.append(f"{where}: `{token}` is no target of CMake")
                    elif slash and top in tops:
                        paths += 1
                        if token not in folders and not fnmatch.filter(files, token):
                            problems.append(f"{where}: `{token}` does not exist")
                    elif not slash and token.endswith(SOURCE_SUFFIX) and not token.startswith("."):
                        paths += 1
                        if token not in saved and not fnmatch.filter(base_names, token):
                            problems.append(f"{where}: `{token}` is no file of the repository")

    for page, example in QUOTES.items():
        lines = [line.strip() for line in (ROOT / example).read_text().splitlines()]
        for block in split(texts[ROOT / page])[0]:
            quoted = [line.strip() for line in block.text.splitlines()]
            if block.language == "cpp" and not any(lines[i:i + len(quoted)] == quoted for i in range(len(lines))):
                problems.append(f"{page}:{block.line}: is no part of {example}")

    contents = "\n".join(block.text for block in split(texts[ROOT / "docs/index.md"])[0] if "toctree" in block.language)
    entries = [line for line in contents.splitlines() if line and not line.startswith(":")]
    for page in texts:
        document = name(page).removeprefix("docs/").removesuffix(".md")
        if page.name in ("README.md", "index.md"):
            continue
        if not any(fnmatch.fnmatch(document, entry) and document.count("/") == entry.count("/") for entry in entries):
            problems.append(f"{name(page)}: is not in the contents of docs/index.md")
    if links < 50 or paths < 100:
        problems.append(f"{links} links and {paths} paths found: must be more than 50 and 100")
    print("\n".join(problems) or f"{links} links and {paths} paths")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
