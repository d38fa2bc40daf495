#!/usr/bin/env python3
"""Files that the programs write, and assets that ship, are as docs/schemas says; spoilt ones are not; the schemas know the fields
that the loaders know. Skips where jsonschema is not installed."""
import argparse
import json
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
LOADERS = {"flash-recording-1.json": ("data/recording/recording.cpp", "data/recording/recording_markers.cpp"),
           "flash-asset-1.json": ("data/asset/asset.cpp",),
           "flash-scene-1.json": ("data/scene/scene.cpp", "data/scene/scene_solver.cpp")}
PUBLISHED = {"timestep", "gravity", "linearsolver", "constraintsolver", "planecollisions", "objects"}  # a scene without a schema


def fields_of(schema):
    """The names of the fields of each object of a schema."""
    if isinstance(schema, dict):
        if "properties" in schema:
            yield set(schema["properties"])
        for value in schema.values():
            yield from fields_of(value)
    elif isinstance(schema, list):
        for value in schema:
            yield from fields_of(value)


def spoilt(value, schema):
    """Copies of an object that are no good: without what is required, with a field of another type, or with one that is not known."""
    for name in schema["required"]:
        yield f"without {name}", {key: field for key, field in value.items() if key != name}
    for name in schema["properties"].keys() & value.keys():
        yield f"{name}: true", {**value, name: 17 if isinstance(value[name], bool) else True}
    if schema.get("additionalProperties") is False:
        yield "shcema", {**value, "shcema": 1}


def write_cell(calib, folder):
    """What register makes of two arms on one camera."""
    still = {"translation": [0, 0, 1], "rotation_xyzw": [1, 0, 0, 0]}
    for name in ("left", "right"):
        (folder / f"{name}.json").write_text(json.dumps(
            {"schema": "flash-extrinsics/2", "setup": "eye-to-hand", "method": "errors_in_variables",
             "transform": still | {"parent": "base", "child": "camera"}, "target_pose": still | {"parent": "gripper", "child": "target"},
             "covariance": [[1e-6 if i == j else 0 for j in range(6)] for i in range(6)]}))
    subprocess.run([calib, "register", folder / "left.json", folder / "right.json", "--without-images", "--workspace", "0.4,0,0.1",
                    "--quiet", "-o", folder / "cell.json"], check=True, stdout=subprocess.DEVNULL)


def main():
    with tempfile.TemporaryDirectory() as folder:
        check(pathlib.Path(folder))


def check(own):
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", nargs="*", type=pathlib.Path, help="searched for JSON of the programs")
    parser.add_argument("--calib", help="flash-calib, for a cell")
    options = parser.parse_args()
    try:
        import jsonschema
    except ImportError:
        print("skipped: found no jsonschema, apt-get install python3-jsonschema")
        return
    schemas = {path.name: json.loads(path.read_text()) for path in sorted((ROOT / "docs/schemas").glob("*.json"))}
    wrong, counts = [], dict.fromkeys(schemas, 0)
    # Debian's jsonschema knows 2020-12; what stands in the schemas is the same in the drafts before.
    kind = getattr(jsonschema, "Draft202012Validator", jsonschema.Draft7Validator)
    for name, schema in schemas.items():
        kind.check_schema(schema)
        for source in LOADERS.get(name, ()):
            for known in re.findall(r"expect_fields\(\{(.*?)\}\)", (ROOT / source).read_text(), re.DOTALL):
                names = set(re.findall(r'"([^"]+)"', known)) - {"bending"}  # of the published format
                if names != PUBLISHED and names not in [fields - {"shape"} for fields in fields_of(schema)] + list(fields_of(schema)):
                    wrong.append(f"docs/schemas/{name}: no object has the fields {sorted(names)} of {source}")
    if options.calib:
        write_cell(options.calib, own)
    for path in [path for folder in [ROOT / "examples", own, *options.folders] for path in sorted(folder.rglob("*.json"))]:
        value = json.loads(path.read_text())
        named = value.get("schema", "") if isinstance(value, dict) else ""
        name = named.replace("/", "-") + ".json"
        if name not in schemas:
            continue
        counts[name] += 1
        validator = kind(schemas[name])
        wrong += [f"{path}: {error.json_path if hasattr(error, 'json_path') else list(error.path)}: {error.message[:200]}"
                  for error in validator.iter_errors(value)]
        wrong += [f"docs/schemas/{name} takes {path} with {what}" for what, bad in spoilt(value, schemas[name]) if validator.is_valid(bad)]
    if options.folders:
        wrong += [f"found no file of {name}" for name, count in counts.items() if not count]
    if wrong:
        sys.exit("\n".join(wrong))
    print(", ".join(f"{count} of {name}" for name, count in counts.items()), "are as docs/schemas says")


if __name__ == "__main__":
    main()
