"""JSON and CSV files of the programs, or a refusal in one line."""
import csv
import json
import pathlib

from flash_sim.bag.errors import refusal


def read_json(path, schema, writer):
    """The object of a JSON file. Throws RecordingError unless it is there and its schema begins so; `writer` is who writes it."""
    try:
        file = json.loads(pathlib.Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise refusal(path, f"cannot be read ({_why(error)}), expected what {writer} writes") from None
    found = file.get("schema") if isinstance(file, dict) else None
    if not str(found).startswith(schema):
        raise refusal(path, f"schema: found {json.dumps(found)[:60]}, expected \"{schema}\", which {writer} writes")
    return file


def read_table(path, numbers, texts=()):
    """Lines of a CSV file as dicts, of the columns `numbers` as float. Throws RecordingError unless it has all these columns, and
    numbers in them."""
    try:
        with open(path, newline="", encoding="utf-8") as file:
            lines = list(csv.reader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise refusal(path, f"cannot be read ({_why(error)}), expected a table of {', '.join((*numbers, *texts))}") from None
    header = lines[0] if lines else []
    if not {*numbers, *texts} <= set(header):
        raise refusal(path, "line 1", f"found \"{','.join(header)[:60]}\", expected the columns {', '.join((*numbers, *texts))}")
    return [_row(path, k, header, line, numbers) for k, line in enumerate(lines[1:], 2)]


def _row(path, number, header, line, numbers):
    if len(line) != len(header):
        raise refusal(path, f"line {number}", f"found {len(line)} fields, expected {len(header)}")
    row = dict(zip(header, line))
    for column in numbers:
        try:
            row[column] = float(row[column])
        except ValueError:
            raise refusal(path, f"line {number}", f"{column}: found \"{row[column][:40]}\", expected a number") from None
    return row


def _why(error):
    return getattr(error, "strerror", None) or " ".join(str(error).split())[:80]
