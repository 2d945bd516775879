#!/usr/bin/env python3
"""What the package says about itself, in several files, agrees: version, licences, components, CI, hooks."""

import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent


def read(name):
    return (ROOT / name).read_text()


def main():
    problems = []
    version = re.search(r"project\(mantle VERSION (\S+)", read("CMakeLists.txt")).group(1)
    for name, pattern in (("CITATION.cff", r"^version: (\S+)$"), ("CHANGELOG.md", r"^## (\S+)")):
        found = re.search(pattern, read(name), re.M)
        if not found or found.group(1) != version:
            problems.append(f"{name}: version must be {version}, as in CMakeLists.txt")

    for name in ("LICENSE", "CITATION.cff"):
        if not re.search("BSD.3.Clause", read(name)):
            problems.append(f"{name}: must name BSD-3-Clause")
    listed = "\n".join(re.findall(r"packages\+?=\(\n(.*?)\n *\)", read("tools/setup"), re.S))
    packages = {word for line in listed.splitlines() for word in line.split("#")[0].split()}
    noticed = set(re.findall(r"^  (\S+) ", read("THIRD_PARTY_NOTICES"), re.M))
    for package in sorted(packages - noticed):
        problems.append(f"THIRD_PARTY_NOTICES: lacks {package}, which tools/setup installs")

    page = read("docs/library.md")
    for file in ROOT.glob("[a-z]*/**/CMakeLists.txt"):
        if file.relative_to(ROOT).parts[0].startswith("build"):
            continue
        for library in re.findall(r"^mantle_(?:library|component)\((\w+)", file.read_text(), re.M):
            if f"`{library}`" not in page:
                problems.append(f"docs/library.md: lacks the component {library}")
    for example in (ROOT / "examples").glob("*.cc"):
        if f"`{example.stem}`" not in page:
            problems.append(f"docs/library.md: lacks the example {example.stem}")

    hooks = read(".pre-commit-config.yaml")
    for repository in re.findall(r"- repo: (\S+)", hooks):
        if repository != "local":
            problems.append(f".pre-commit-config.yaml: {repository} is fetched, must be local")
    for tool in ("clang-format", "clang-tidy", "cppcheck"):
        if f"id: {tool}" not in hooks:
            problems.append(f".pre-commit-config.yaml: lacks {tool}")
    for script in (".ci/run", "tools/package"):
        if script not in read(".github/workflows/ci.yml"):
            problems.append(f".github/workflows/ci.yml: must call {script}")
        if not (ROOT / script).stat().st_mode & 0o100:
            problems.append(f"{script}: must be executable")
    for problem in problems:
        print(problem)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
