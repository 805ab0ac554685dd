"""Writes standstill/_types.py and _sheet.py: the tables of a scenario and of a data sheet, and the choices of options, as types, from
what the program says of them.

    python crates/python/scripts/write_types.py path/to/standstill
"""

import json
import keyword
import re
import subprocess
import sys
import textwrap
from pathlib import Path
from typing import Any

from standstill import _standstill

#: What is no key of a scenario: name, command, option.
CHOICES = [("Format", "run", "format"), ("Rows", "run", "rows"), ("Effort", "odds", "effort")]

#: Two tables of one name in the schema: a motor's, and the scenario's.
NAMES = {"RotorTable": "MotorRotorTable", "RotorTable2": "RotorTable", "Motor": "MotorSpec"}

HEAD = '''"""{} as types. Written by crates/python/scripts/write_types.py from the program's schema; a test compares."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypeAlias, TypedDict, Union
'''


def literal(values: list[str]) -> str:
    return f"Literal[{', '.join(json.dumps(value) for value in values)}]"


class Writer:
    def __init__(self, schema: dict[str, Any]) -> None:
        self.defs = schema["$defs"]
        self.out: list[str] = []
        self.done: set[str] = set()

    def named(self, name: str) -> str:
        """A definition, written before what refers to it."""
        known = NAMES.get(name, name)
        if name not in self.done:
            self.done.add(name)
            schema = self.defs[name]
            written = self.of(schema, known if "properties" in schema else known + "Table")
            if written != known:
                self.out.append(f"#: {self.said(self.defs[name])}\n{known}: TypeAlias = {written}\n")
        return known

    @staticmethod
    def said(schema: dict[str, Any]) -> str:
        return " ".join(schema.get("description", "").split())

    def of(self, schema: dict[str, Any], name: str) -> str:
        """The type of a schema; one with keys of its own gets a class of this name."""
        if "$ref" in schema:
            return self.named(schema["$ref"].rpartition("/")[2])
        if "const" in schema:
            return literal([schema["const"]]) if isinstance(schema["const"], str) else "float"
        for several in ("oneOf", "anyOf"):
            if several in schema:
                kinds = [kind for kind in schema[several] if kind != {"type": "null"}]
                if all(isinstance(kind.get("const"), str) for kind in kinds):
                    return literal([kind["const"] for kind in kinds])
                types = list(dict.fromkeys(self.of(kind, name) for kind in kinds))
                return types[0] if len(types) == 1 else f"Union[{', '.join(types)}]"
        if "enum" in schema:
            return literal(schema["enum"])
        kinds = schema.get("type", [])
        kinds = [kinds] if isinstance(kinds, str) else [kind for kind in kinds if kind != "null"]
        if kinds == ["object"]:
            if "properties" in schema:
                return self.table(schema, name)
            inner = schema.get("additionalProperties")
            return f"Mapping[str, {self.of(inner, name + 'Value') if isinstance(inner, dict) and inner else 'Any'}]"
        if kinds == ["array"]:
            return f"Sequence[{self.of(schema['items'], name + 'Item') if schema.get('items') else 'Any'}]"
        plain = {"string": "str", "number": "float", "integer": "int", "boolean": "bool"}
        types = [plain[kind] for kind in kinds] or ["float"] * bool({"minimum", "exclusiveMinimum"} & set(schema))
        return "Any" if not types else types[0] if len(types) == 1 else f"Union[{', '.join(types)}]"

    def table(self, schema: dict[str, Any], name: str) -> str:
        keys = {key: (self.of(value, name + key.title().replace("_", "")), self.said(value)) for key, value in schema["properties"].items()}
        said = self.said(schema)
        if set(keys) == {"value", "source", "reason"}:
            # A number of a data sheet, and where it comes from.
            of = keys["value"][0]
            name = "Sourced" + "".join(part.title() for part in re.findall(r"float|int|str", of))
            if name in self.done:
                return name
            self.done.add(name)
        if any(keyword.iskeyword(key) or not key.isidentifier() for key in keys):
            lines = [f"    {json.dumps(key)}: {kind},  # {about}" for key, (kind, about) in keys.items()]
            self.out.append("\n".join([f"#: {said}", f'{name} = TypedDict("{name}", {{', *lines, "}, total=False)"]) + "\n")
        else:
            lines = [line for key, (kind, about) in keys.items() for line in (*([f"    #: {about}"] if about else []), f"    {key}: {kind}")]
            about = textwrap.indent(json.dumps(said or f"`{name}` of a scenario.", ensure_ascii=False), "    ")
            self.out.append("\n".join([f"class {name}(TypedDict, total=False):", about, "", *lines]) + "\n")
        return name


def texts(program: str) -> dict[str, str]:
    """The files: that of data sheets, and that of scenarios, which refers to it."""
    schema = json.loads(subprocess.run([program, "schema"], capture_output=True, text=True, check=True).stdout)
    writer = Writer(schema)
    writer.named("Motor")
    motor = "\n".join([HEAD.format("Data sheets"), *writer.out])
    choices = [f"#: Choices of the option `{option}`.\n{name}: TypeAlias = {literal(_standstill.choices(command, option))}\n" for name, command, option in CHOICES]
    writer.out = []
    writer.table({**schema, "description": "A scenario: `st.run({...})` takes it, and editors complete its keys."}, "ScenarioDict")
    scenario = "\n".join([HEAD.format("Scenarios, and choices of options,") + "\nfrom ._sheet import MotorSpec\n", *choices, *writer.out])
    return {"_sheet.py": motor, "_types.py": scenario}


if __name__ == "__main__":
    for name, text in texts(sys.argv[1]).items():
        (Path(__file__).resolve().parents[1] / "standstill" / name).write_text(text)
