"""The methods of a scene that add things: their signatures and docstrings, from the tables of the scene format."""

import json
from inspect import Parameter, Signature, cleandoc, signature

from . import _models
from ._firstlight import _nearest, _schema

# The families whose things are called by a key, which is the first argument
_NAMED = ("material", "texture")


def _tables():
    """The table of each kind of thing, as JSON Schema, by family and kind."""
    found = {}
    for name, table in json.loads(_schema())["$defs"].items():
        family, _, kind = name.rpartition(".")
        found[family or (kind if kind in ("render", "camera") else "shape"), kind] = table
    return found


TABLES = _tables()


def default(family, kind, field):
    """What a field is that a thing does not say; None where it has none."""
    known = TABLES[family, kind]["properties"]
    if field in known:
        return known[field].get("default")
    near = _nearest(str(field), list(known))
    raise KeyError(f"{kind} has no field {field!r}" + (f"; did you mean {near!r}?" if near else ""))


def method(name, family, kind, table, handle):
    """A method of `Scene` that adds things of a kind."""

    def added(self, name, fields):
        if fields.get("file") is not None:
            fields["file"] = _models.file_of(self, fields["file"])
        return handle(self, *self._add(family, kind, name, fields))

    def named(self, name, **fields):
        return added(self, name, fields)

    def unnamed(self, **fields):
        return added(self, "", fields)

    add = named if family in _NAMED else unnamed
    add.__name__, add.__qualname__ = name, f"Scene.{name}"
    add.__signature__ = _signature(family, table)
    add.__doc__ = _doc(family, kind, table)
    return add


def _signature(family, table):
    """What it takes: the fields of the table, those first that it needs."""
    first = [Parameter("self", Parameter.POSITIONAL_OR_KEYWORD)]
    if family in _NAMED:
        first.append(Parameter("name", Parameter.POSITIONAL_OR_KEYWORD))
    fields = _fields(table)
    only, others = Parameter.KEYWORD_ONLY, [one for one in fields if not one[2]]
    needed = [Parameter(key, only) for key, _, needed in fields if needed]
    return Signature(first + needed + [Parameter(key, only, default=field.get("default")) for key, field, _ in others])


def extended(function, name, table):
    """A method of `Scene` that does what a function does, with the fields of a table in its signature and docstring."""

    def add(self, *given, **fields):
        return function(self, *given, **fields)

    own = [one for one in signature(function).parameters.values() if one.kind != Parameter.VAR_KEYWORD]
    names = {one.name for one in own}
    more = [one for key, one in _signature("", table).parameters.items() if key not in names]
    add.__name__, add.__qualname__ = name, f"Scene.{name}"
    add.__signature__, add.__doc__ = Signature([*own, *more]), function.__doc__
    add_to_doc(add, (table, names))
    return add


def _fields(table):
    """The fields: name, schema, whether it is needed."""
    needed = table.get("required", ())
    return [(key, field, key in needed) for key, field in table["properties"].items()]


def _doc(family, kind, table):
    """A docstring: what the kind is, and each of its fields."""
    text = {"shape": f"[[{kind}]]", "light": f"[[light.{kind}]]"}.get(family, f"[{family}.{kind}.NAME]")
    lines = [f"Adds a {family}, `{text}` of a scene's text. {table['description']}", "", "Parameters", "----------"]
    if family in _NAMED:
        lines += ["name : str", f"    What the scene calls it; no other {family} may be called so."]
    return "\n".join([*lines, *_lines(_fields(table)), "", "Returns", "-------", "Handle", ""])


def add_to_doc(method, *places):
    """Lists fields in the docstring of a method: those of some tables, each without those that are left out."""
    fields = [one for table, left_out in places for one in _fields(table) if one[0] not in left_out]
    method.__doc__ = "\n".join([cleandoc(method.__doc__), "", "Fields", "------", *_lines(fields), ""])


def _lines(fields):
    """What a docstring says of fields, those first that are needed."""
    lines = []
    for key, field, needed in sorted(fields, key=lambda one: not one[2]):
        default = "" if needed else f", default {field['default']!r}" if "default" in field else ", optional"
        lines += [f"{key} : {_type(field)}{default}", f"    {field['description']}"]
    return lines


def _type(field):
    """What a field takes, in a few words."""
    if "$ref" in field:
        return "dict" + (" or matrix of 4 x 4" if field["$ref"].endswith("/transform") else "")
    for key in ("anyOf", "oneOf"):
        if key in field:
            words = [_type(one) for one in field[key]]
            return " or ".join(dict.fromkeys(words))
    if "enum" in field:
        return "{" + ", ".join(json.dumps(word) for word in field["enum"]) + "}"
    if "const" in field:
        return json.dumps(field["const"])
    if field.get("type") == "array":
        of, count = _type(field.get("items", {})), field.get("minItems")
        return f"{count} of {of}" if count is not None and count == field.get("maxItems") else f"list of {of}"
    return {"number": "float", "integer": "int", "boolean": "bool", "string": "str", "object": "dict"}.get(
        field.get("type"), "any"
    )
