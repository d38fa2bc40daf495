"""The reference scenes' quantities beside what was computed, judged as their compare.py does."""
import json
import math

KINDS = {"cantilever": "heavy strip, clamped (elastica)", "equil": "equilibria that must hold",
         "free_fall": "free fall", "hang_strip": "strip under its weight", "impact": "impact with friction",
         "incline": "stick and slip on an incline", "lift11": "corner lift from a table",
         "shear": "pure shear", "slide": "sliding to rest", "stretch": "uniaxial stretch",
         "tet_cantilever": "solid cantilever and its limit", "tet_uniaxial": "solid bar, drawn and pressed",
         "tetdrop": "soft cube on a slope", "unit": "energy and forces at given positions"}


def rows_of(name, scenes, results):
    """(quantity, value, reference, error, allowed) of a scene; of many numbers the one that is farthest off."""
    scene = json.loads((scenes / f"{name}.json").read_text())
    result = json.loads((results / f"{name}.json").read_text())
    rows = []
    if "positions" in result:
        reference, rest = points(scenes / scene["reference_positions"]), vertices(scenes / scene["mesh"])
        moved = max(map(math.dist, reference, rest))
        error = max(map(math.dist, result["positions"], reference))
        rows.append(("largest distance of a vertex m", error, 0.0, error,
                     scene.get("position_tolerance", 0.02 * moved + 1e-4)))
    for time, positions in result.get("frames", {}).items():
        reference = points(scenes / scene["frames"][time]["positions"])
        error = math.sqrt(sum(math.dist(a, b) ** 2 for a, b in zip(positions, reference)) / len(reference))
        sensitivity = scene["frames"][time].get("rms_sensitivity_mm", {}).get("logE", 0)
        allowed = scene["expected"][0]["tolerance"]["atol"] + 0.05e-3 * sensitivity
        rows.append((f"rms distance at {time} s m", error, 0.0, error, allowed))
    for entry in scene["expected"]:
        reference, found = flat(entry["value"]), flat(result["quantities"][entry["quantity"]])
        largest = max(map(abs, reference))
        reference = reference * len(found) if len(reference) == 1 else reference
        value, wanted = max(zip(found, reference), key=lambda pair: abs(pair[0] - pair[1]))
        tolerance = entry["tolerance"]
        rows.append((entry["quantity"].strip(), value, wanted, abs(value - wanted),
                     tolerance.get("rtol", 0) * largest + tolerance.get("atol", 0)))
    return rows


def tables(scenes, results, table):
    """`reference_worst`: a row a kind of scene, `reference`: every quantity."""
    rows, worst = [], {}
    for path in sorted(results.glob("*.json")):
        kind = next(kind for kind in KINDS if path.stem.startswith(kind))
        for quantity, value, reference, error, allowed in rows_of(path.stem, scenes, results):
            rows.append([path.stem, quantity, number(value), number(reference), number(error), number(allowed)])
            worst.setdefault(kind, []).append((error / allowed, path.stem, quantity))
    summary = [[KINDS[kind], str(len({name for _, name, _ in found})), str(len(found)),
                "{:.2g}, {}: {}".format(*max(found))] for kind, found in worst.items()]
    return {"reference_worst": table(["scenes", "how many", "quantities", "largest error over what is allowed"],
                                     summary),
            "reference": table(["scene", "quantity", "value", "reference", "error", "allowed"], rows)}


def number(value):
    return f"{value:.6g}" if value == 0 or 1e-4 <= abs(value) < 1e5 else f"{value:.3e}"


def flat(value):
    return [number for entry in value for number in flat(entry)] if isinstance(value, list) else [value]


def points(path):
    return [tuple(map(float, line.split(","))) for line in path.read_text().splitlines()]


def vertices(path):
    return [tuple(map(float, line.split()[1:4])) for line in path.read_text().splitlines() if line.startswith("v ")]
