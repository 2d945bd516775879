#!/usr/bin/env python3
"""book_reference.py ROOT XML OUT: writes the pages of the book's reference into the folder OUT, one for every
folder of public headers, and one for the module for Python. In Doxygen's XML it mends what Sphinx does not read."""

import ast
import copy
import inspect
import pathlib
import re
import sys
import xml.etree.ElementTree as tree

FOLDERS = {
    "model": "Mechanics: robot, loads, rod, shell, rigid body, integrators, statics",
    "reduced": "The reduced model at run time",
    "reduced/build": "Making a reduced model of a robot",
    "controller": "Plans, baselines, estimators",
    "firmware_sim/bus": "CAN buses",
    "firmware_sim/canopen": "CANopen",
    "firmware_sim/drive": "Drives",
    "firmware_sim/master": "Master of the drives",
    "loop": "The closed loop",
    "loop/plant_side": "The plant's side of the wire",
    "loop/control_side": "The controller's side of the wire",
    "loop/scene": "Scene files",
}


def mend(text):
    """Numbers and texts in several parts, which Doxygen keeps apart or splits, in one: Sphinx reads no others."""
    text = re.sub(r"(?<=\d) (?:'|&apos;)(?=\d)", "", text)
    return re.sub(r"(?:&quot;|\")\s*\n\s*(?:&quot;|\")", "", text)


def about(header):
    """What a header says before it opens its namespace; what it says of itself as a file, Breathe prints."""
    found = re.search(r"((?:^///[^\n]*\n)+)\s*(?:#define[^\n]*\n\s*)*^namespace mantle", header, re.M)
    if not found or "@file" in found.group(1):
        return ""
    text = re.sub(r"^/// ?", "", found.group(1), flags=re.M).rstrip()
    return f"```text\n{text}\n```\n\n"


def split_namespaces(xml):
    """Gives every header namespaces of its own, with what it declares there. Doxygen has one of each for all
    headers, which Breathe would go through for every header anew."""
    namespaces = {page.stem: tree.parse(page) for page in xml.glob("namespace*.xml")}
    for page in xml.glob("*_8h.xml"):
        header = tree.parse(page)
        compound = header.find("compounddef")
        location = compound.find("location").get("file")
        classes = {inner.get("refid") for inner in compound.findall("innerclass")}
        for reference in compound.findall("innernamespace"):
            part = copy.deepcopy(namespaces[reference.get("refid")])
            inside = part.find("compounddef")
            for section in inside.findall("sectiondef"):
                for member in section.findall("memberdef"):
                    if member.find("location").get("file") != location:
                        section.remove(member)
                if section.find("memberdef") is None:
                    inside.remove(section)
            for other in inside.findall("innerclass"):
                if other.get("refid") not in classes:
                    inside.remove(other)
            # What headers say of themselves before they open a namespace, Doxygen adds up there; `about` has it.
            for kind in ("innernamespace", "briefdescription", "detaileddescription"):
                for other in inside.findall(kind):
                    inside.remove(other)
            if inside.find("sectiondef") is None and inside.find("innerclass") is None:
                compound.remove(reference)
                continue
            name = f"{reference.get('refid')}_in_{page.stem}"
            inside.set("id", name)
            reference.set("refid", name)
            part.write(xml / f"{name}.xml", encoding="unicode")
        header.write(page, encoding="unicode")


def public(node):
    """Whether a stub's or module's definition is one for users."""
    return isinstance(node, (ast.ClassDef, ast.FunctionDef)) and (node.name == "__init__" or node.name[0] != "_")


def signature(node):
    """The line with which a function or class is called."""
    if isinstance(node, ast.FunctionDef):
        returns = f" -> {ast.unparse(node.returns)}" if node.returns else ""
        return f"{node.name}({ast.unparse(node.args)}){returns}"
    bases = ", ".join(ast.unparse(base) for base in node.bases if ast.unparse(base) != "_Base")
    return f"class {node.name}({bases})" if bases else f"class {node.name}"


def described(node, level):
    """A definition with its members as Markdown."""
    text = ast.get_docstring(node) or ""
    properties = [ast.unparse(d) for d in getattr(node, "decorator_list", ())]
    call = node.name if "property" in properties else signature(node)
    out = f"{'#' * level} {node.name}\n\n```python\n{call}\n```\n\n"
    if text:
        out += f"```text\n{inspect.cleandoc(text)}\n```\n\n"
    for member in getattr(node, "body", ()):
        if isinstance(node, ast.ClassDef) and public(member) and (ast.get_docstring(member) or member.name != "__init__"):
            out += described(member, level + 1)
    return out


def python_page(root):
    """The reference of the module for Python, from its sources and the stub of its compiled part."""
    package = root / "python/mantle"
    names = ast.literal_eval(next(
        node.value for node in ast.parse((package / "__init__.py").read_text()).body
        if isinstance(node, ast.Assign) and node.targets[0].id == "__all__"))
    found = {}
    for file in [*sorted(package.glob("*.py")), package / "_mantle.pyi"]:
        for node in ast.parse(file.read_text()).body:
            if public(node) and node.name in names:
                found[node.name] = node
    missing = set(names) - found.keys() - {"__version__"}
    if missing:
        sys.exit(f"book_reference.py: nothing describes mantle's {', '.join(sorted(missing))}")
    functions = [n for n in names if isinstance(found.get(n), ast.FunctionDef)]
    classes = [n for n in names if isinstance(found.get(n), ast.ClassDef)]
    return ("# Python reference\n\nFrom the docstrings of the module `mantle`. [Mantle from Python](../python.md) is where "
            "to begin.\n\n" + "".join(described(found[n], 2) for n in functions + classes))


def main():
    root, xml, out = (pathlib.Path(argument) for argument in sys.argv[1:])
    for page in xml.glob("*.xml"):
        before = page.read_text()
        after = mend(before)
        if after != before:
            page.write_text(after)
    split_namespaces(xml)
    headers = [path.relative_to(root).as_posix()
               for top in ("model", "reduced", "controller", "firmware_sim", "loop")
               for path in sorted((root / top).rglob("*.h"))]
    unknown = {header.rpartition("/")[0] for header in headers} - FOLDERS.keys()
    if unknown:
        sys.exit(f"book_reference.py: no title for the folders {', '.join(sorted(unknown))}")
    out.mkdir(parents=True, exist_ok=True)
    entries = []
    for folder, title in FOLDERS.items():
        inside = [header for header in headers if header.rpartition("/")[0] == folder]
        entries.append(folder.replace("/", "_"))
        (out / f"{entries[-1]}.md").write_text(f"# {title}\n\n" + "".join(
            f"## {header}\n\n{about((root / header).read_text())}```{{doxygenfile}} {header}\n```\n\n" for header in inside))
    (out / "python.md").write_text(python_page(root))
    (out / "index.md").write_text(
        "# C++ reference\n\nFrom the public headers. [Mantle as a library](../library.md) says what to link.\n\n"
        "```{toctree}\n:maxdepth: 2\n\n" + "\n".join(entries) + "\n```\n")



if __name__ == "__main__":
    main()
