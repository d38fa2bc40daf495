"""Which fields docs/formats.md names, by schema."""
import re


def names_in(text):
    """Words between backticks."""
    return {word for quoted in re.findall(r"`([^`]*)`", text) for word in re.findall(r"[A-Za-z0-9_]+", quoted)}


def fields_by_schema(text):
    """Of the row of a table that starts with the schema, or of the section that names it."""
    fields = {}
    for section in re.split(r"(?m)^(?=## )", text):
        for schema in re.findall(r'(?:"schema": "|`)(flash-[a-z-]+/\d+)["`]', section):
            fields.setdefault(schema, set()).update(names_in(section))
    for line in text.splitlines():
        if match := re.match(r"\| `(flash-[a-z-]+/\d+)` \|", line):
            fields[match[1]] = names_in(line)
    return fields


def unnamed(value, known, by_name=(), path=""):
    """Paths of fields that are not among `known`, at any depth. by_name: fields whose own keys are names, of methods or
    the like."""
    if isinstance(value, list):
        for item in value:
            yield from unnamed(item, known, by_name, path)
    if isinstance(value, dict):
        of_names = path.rpartition(".")[2] in by_name
        for key, item in value.items():
            here = f"{path}.{key}".lstrip(".")
            if not of_names and key not in known | {"schema"}:
                yield here
            yield from unnamed(item, known, by_name, here)
