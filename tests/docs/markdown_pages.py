"""What the pages under docs/ and the README hold: code blocks, commands in them, paths and links."""

import dataclasses
import pathlib
import re
import subprocess

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent

# How a line of a block without a language begins where it is one to type.
TYPED = re.compile(r"^(build/\w+|tools/\w+|mantle|cmake|ctest|lcm-\w+|can(dump|send|player|gen)|sudo|pip|python3) [\w\-/'\"]")


@dataclasses.dataclass
class Block:
    """A fenced or indented code block: `line` is that of its first line of text, from 1."""
    language: str
    line: int
    text: str


def pages():
    """Every page that people read as documentation, the README first."""
    return [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def name(page):
    return page.relative_to(ROOT).as_posix()


def split(text):
    """The code blocks of a page, and its text without them (as many lines)."""
    blocks, prose, block, previous = [], [], None, ""
    for number, line in enumerate(text.splitlines(), 1):
        fence = re.match(r"^(`{3,})(.*)$", line)
        if block is not None and block.language != "indented":
            if fence and not fence.group(2):
                block = None
            else:
                block.text += line + "\n"
            prose.append("")
        elif fence:
            block = Block(fence.group(2).strip(), number + 1, "")
            blocks.append(block)
            prose.append("")
        elif line.startswith("    ") and (block is not None or not previous.strip()):
            if block is None:
                block = Block("indented", number, "")
                blocks.append(block)
            block.text += line[4:] + "\n"
            prose.append("")
        else:
            block = None
            prose.append(line)
        previous = line
    return blocks, "\n".join(prose)


def is_typed(block):
    """Whether the block is one of commands: it says so, or it looks like it."""
    if block.language in ("sh", "bash", "shell", "console"):
        return True
    return block.language in ("", "indented") and any(TYPED.match(line) for line in block.text.splitlines())


def commands(block):
    """The commands of a block with their line numbers; one that goes over several lines is kept whole."""
    found, pending, begin = [], "", block.line
    for number, line in enumerate(block.text.splitlines(), block.line):
        if not pending:
            begin = number
        pending += line + "\n"
        if line.endswith("\\"):
            continue
        if subprocess.run(["bash", "-n"], input=pending, text=True, capture_output=True).returncode == 0:
            if pending.strip() and not pending.strip().startswith("#"):
                found.append((begin, pending))
            pending = ""
    if pending:
        raise ValueError(f"line {begin}: bash does not read this: {pending.strip()}")
    return found


def file_of(block):
    """(name, text) where a block's first line is a comment with a file's name: the reader is to save it."""
    first = re.match(r"^(?:#|//) ([\w-]+\.(?:toml|py|cc))\n", block.text)
    return (first.group(1), block.text) if first else None


def slugs(text):
    """Anchors of a page's headings, as forges and the book name them."""
    _, prose = split(text)
    found, seen = set(), {}
    for heading in re.findall(r"^#+ (.*)$", prose, re.M):
        slug = re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")
        found.add(slug + (f"-{seen[slug]}" if slug in seen else ""))
        seen[slug] = seen.get(slug, 0) + 1
    return found
