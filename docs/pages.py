"""What MkDocs adds when it builds the site: pages made from code, and files from outside `docs/`.

A hook of `mkdocs.yml`. Links to what lies outside `docs/` are written as the repository has them;
on the site the same files stand under SHOWN.
"""

import contextlib
import io
import os
import re
from importlib import import_module
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

from rigid import _HOMES
from rigid.__main__ import COMMANDS
from rigid.spec.values import schema

ROOT = Path(__file__).parents[1]
SHOWN = ("CHANGELOG.md", "CONTRIBUTING.md")
"""Pages of the repository's root that the site has as well."""

OUTSIDE = re.compile(r"\]\((?:\.\./)+(CHANGELOG\.md|CONTRIBUTING\.md|reports/examples/)")
MATH = re.compile(r"^```math\n(.*?)^```$", re.DOTALL | re.MULTILINE)
INSIDE = re.compile(r"\]\(docs/")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages made from code, those of the root, and the example reports."""
    made = {"commands.md": commands(), "spec-keys.md": keys(schema()), "api.md": api()}
    for name in SHOWN:
        made[name] = (ROOT / name).read_text("utf-8").replace("](README.md", "](index.md")
    for name, text in made.items():
        files.append(File.generated(config, name, content=INSIDE.sub("](", text)))
    for path in sorted((ROOT / "reports" / "examples").glob("*/index.html")):
        name = path.relative_to(ROOT).as_posix()
        files.append(File.generated(config, name, abs_src_path=str(path)))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Lead links that leave `docs/` to where the site has those files; set equations as MathML."""
    markdown = MATH.sub(_mathml, markdown)
    up = "../" * page.file.src_uri.count("/")
    return OUTSIDE.sub(rf"]({up}\1", markdown)


def _mathml(found: re.Match[str]) -> str:
    return f'<div style="overflow-x: auto">{convert(found[1], display="block")}</div>'


def commands() -> str:
    """What every command says of itself."""
    os.environ["COLUMNS"] = "100"
    text = ["# Commands", "", "Made from the commands themselves.", ""]
    for name in COMMANDS:
        command, told = import_module(f"rigid.{name}"), io.StringIO()
        with contextlib.redirect_stdout(told), contextlib.suppress(SystemExit):
            command.main(["--help"])
        text += [f"## rigid {name}", "", command.SAYS, "", "```text", told.getvalue(), "```", ""]
    return "\n".join(text)


def api() -> str:
    """Every name that `rigid` gives, as its docstrings tell it."""
    text = ["# Python", "", "Made from the docstrings; [the library](library.md) shows the use."]
    for name, home in sorted(_HOMES.items()):
        text += ["", f"## rigid.{name}", "", f"::: rigid.{home.replace(':', '.')}"]
        text += ["    options:", "      show_root_heading: false"]
    return "\n".join(text)


def keys(found: dict[str, Any]) -> str:
    """Every table and key of a spec with its type and default, from the schema that checks it."""
    said = "Made from the fields that the code declares; [the spec](spec.md) tells what they mean."
    text = ["# Every key of a spec", "", said, ""]
    for name, table in {"The spec": found, **found["$defs"]}.items():
        text += [f"## {name.removesuffix('Spec')}", "", table.get("description", ""), ""]
        if "properties" not in table:
            continue
        text += ["| key | type | default |", "|---|---|---|"]
        needed = table.get("required", [])
        for key, value in table["properties"].items():
            default = "required" if key in needed else f"`{value.get('default')}`"
            if isinstance(value.get("default"), dict):
                default = "those of its keys"
            text.append(f"| `{key}` | {sort(value)} | {default} |")
        text.append("")
    return "\n".join(text)


def sort(value: dict[str, Any]) -> str:
    """The type of a key, in words."""
    if "$ref" in value:
        name = value["$ref"].rsplit("/", 1)[1].removesuffix("Spec")
        return f"[{name}](#{name.lower()})"
    for several in ("anyOf", "oneOf"):
        if several in value:
            return " or ".join(dict.fromkeys(map(sort, value[several])))
    if "enum" in value or "const" in value:
        return ", ".join(f"`{one}`" for one in value.get("enum", [value.get("const")]))
    if value.get("type") == "array":
        return f"list of {sort(value.get('items', {}))}"
    if isinstance(value.get("additionalProperties"), dict):
        return f"table of {sort(value['additionalProperties'])}"
    return str(value.get("type", "anything"))
