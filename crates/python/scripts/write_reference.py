"""Prints the reference of the package in Markdown: what `standstill.__all__` has, by signatures and docstrings of the source.

    python crates/python/scripts/write_reference.py
"""

import ast
import re
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1] / "standstill"


def marked(text: str) -> str:
    """A docstring in Markdown: examples as code, roles as code, as one paragraph each."""
    parts, code = [], []
    for block in re.split(r"\n\s*\n", text):
        if block.lstrip().startswith(">>>"):
            code.append(f"```python\n{block}\n```")
        else:
            block = re.sub(r":(?:func|class|data|attr|meth):`~?([^`]+)`", r"`\1`", block)
            parts.append(re.sub(r"``([^`]+)``", r"`\1`", block))
    return "\n\n".join([*parts, *code])


def signature(of: ast.FunctionDef) -> str:
    returns = f" -> {ast.unparse(of.returns)}" if of.returns else ""
    arguments = ast.unparse(of.args)
    if len(arguments) > 80:
        arguments = "\n    " + re.sub(r", (?=[\w*/]+(?::|,|$| =))", ",\n    ", arguments) + ",\n"
    return f"{of.name}({arguments}){returns}"


def fields(source: list[str], of: ast.ClassDef) -> list[str]:
    """Attributes of a class with the comments before them."""
    found = []
    for item in of.body:
        if isinstance(item, ast.AnnAssign) and isinstance(item.target, ast.Name):
            row, said = item.lineno - 2, []
            while source[row].strip().startswith("#:"):
                said.insert(0, source[row].strip()[2:].strip())
                row -= 1
            found.append(f"* `{item.target.id}: {ast.unparse(item.annotation)}` " + marked(" ".join(said)))
    return found


def entry(source: list[str], of: ast.stmt) -> str:
    if isinstance(of, ast.FunctionDef):
        return f"### {of.name}\n\n```python\n{signature(of)}\n```\n\n{marked(ast.get_docstring(of) or '')}\n"
    assert isinstance(of, ast.ClassDef)
    methods = [item for item in of.body if isinstance(item, ast.FunctionDef) and not item.name.startswith("_")]
    said = [f"* `{signature(item)}` {marked(ast.get_docstring(item) or '')}" for item in methods]
    return "\n".join([f"### {of.name}\n", marked(ast.get_docstring(of) or ""), "", *fields(source, of), *said, ""])


def reference() -> str:
    init = ast.parse((PACKAGE / "__init__.py").read_text())
    entries: dict[str, tuple[bool, str]] = {}
    for imported in (item for item in init.body if isinstance(item, ast.ImportFrom) and item.module != "_standstill"):
        text = (PACKAGE / f"{imported.module}.py").read_text()
        known = {item.name: item for item in ast.parse(text).body if isinstance(item, (ast.FunctionDef, ast.ClassDef))}
        for name in (alias.name for alias in imported.names):
            entries[name] = (isinstance(known[name], ast.FunctionDef), entry(text.splitlines(), known[name]))
    entries["Error"] = (False, "### Error\n\nWhat is wrong, as a `ValueError`.\n")
    lists = ["\n".join(text for _, (is_function, text) in sorted(entries.items()) if is_function is wanted) for wanted in (True, False)]
    head = "# Python's functions\n\nWhat the package `standstill` has; [Python](python.md) shows how it is used.\n\n"
    return f"{head}## Functions\n\n{lists[0]}\n## Classes\n\n{lists[1]}"


if __name__ == "__main__":
    print(reference())
