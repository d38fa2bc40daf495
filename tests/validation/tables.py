"""Results as Markdown tables, and their place in the document."""
import csv
import math
import re

import lifts
import twins


def replace_tables(folder, tables):
    """Puts each table between its `<!-- name -->` and the next `<!-- end -->` of a chapter, or into name.csv where that is there."""
    chapters = {path: path.read_text() for path in sorted(folder.glob("*.md"))}
    for name, table in tables.items():
        if (folder / f"{name}.csv").exists():
            write_csv(folder / f"{name}.csv", table)
            continue
        places = 0
        for path, text in chapters.items():
            chapters[path], count = re.subn(rf"(<!-- {name} -->\n).*?(<!-- end -->)", lambda m: m[1] + table + m[2], text,
                                            flags=re.DOTALL)
            places += count
        if places != 1:
            raise SystemExit(f"validate: {folder}: {places} places for the table {name}, expected one")
    for path, text in chapters.items():
        path.write_text(text)


def write_csv(path, table):
    with path.open("w", newline="") as file:
        header, _, *rows = [line[2:-2].split(" | ") for line in table.splitlines()]
        csv.writer(file, lineterminator="\n").writerows([header, *rows])


def table(header, rows):
    lines = ["| " + " | ".join(row) + " |" for row in [header, ["---"] * len(header), *rows]]
    return "\n".join(lines) + "\n"


def mm(metres, digits=2):
    return "-" if metres is None else f"{1000 * metres:.{digits}f}"


def number(value):
    """Two digits, powers of ten written out: 8.0e-4."""
    if value >= 0.01:
        return f"{value:.3g}"
    exponent = math.floor(math.log10(value))
    return f"{value / 10 ** exponent:.1f}e{exponent}"


def finding_text(summary, name):
    finding = summary["parameters"].get(name)
    if finding is None:
        return "-"
    low, high = map(number, finding["interval95"])
    return {"yes": f"{low} to {high}", "lower_bound": f"at least {low}", "upper_bound": f"at most {high}",
            "no": f"none of {low} to {high} excluded"}[finding["identifiable"]]


def clip_table(fits):
    rows = []
    for clip, fit in fits.items():
        material, given = fit["material"], lifts.CLIPS[clip]
        best = material["best"]
        rows.append([clip, mm(best["score_on_mesh"]), given["independent"], str(given.get("floor", "-")), material["grasp"],
                     f"{best['parameters']['start_yaw']:.2f}", number(best["parameters"]["bending"]),
                     finding_text(material, "bending"), finding_text(material, "young"),
                     f"{material['unconverged']} of {material['candidates']}"])
    return table(["clip", "residual mm", "independent solver mm", "trial to trial mm", "grasp", "start yaw rad",
                  "D N m", "95 % of D", "E t N/m", "candidates that missed a step"], rows)


def lift_tables(results):
    fits, pairs = results["fits"], results["pairs"]
    offsets, shapes = [], []
    for clip, fit in fits.items():
        material = fit["material"]
        recording = material["recordings"][0]
        offset = " / ".join(mm(x, 0) for x in recording["offset"])
        offsets.append([clip, offset, f"{recording['yaw']:.3f}", f"{1000 * recording['time_offset']:.0f}",
                        "; ".join(w.split(": ", 1)[1] for w in material["warnings"] if "at its bound" in w) or "-"])
        shapes.append([clip, *(mm(fit["shapes"][s]["best"]["score_on_mesh"]) if s in fit["shapes"] else "-"
                               for s in lifts.GRASPS),
                       ", ".join(f"{value:+.2f}: {mm(score, 1)}" for value, score in
                                 lifts.profile(fit["shapes"][material["grasp"]]["rows"], "start_yaw"))])
    cross = []
    for pair, (first, second) in lifts.PAIRS.items():
        for source, target, found in ((first, second, pairs[pair]["there"]), (second, first, pairs[pair]["back"])):
            cross.append([source, target, mm(found["predicted"]["score"]),
                          mm(fits[target]["material"]["best"]["score_on_mesh"]), mm(found["median"]["score"]),
                          *band_of(found["band"])])
    joint = [[pair, number(search["best"]["parameters"]["bending"]), finding_text(search, "bending"),
              " / ".join(mm(recording["score"]) for recording in search["recordings"])]
             for pair, search in ((pair, pairs[pair]["joint"]) for pair in lifts.PAIRS)]
    return {
        "lifts": clip_table(fits),
        "offsets": table(["clip", "offset x / y / z mm", "yaw rad", "clock ms", "at a bound"], offsets),
        "shapes": table(["clip", "clamp mm", "point mm", "pinch mm", "start yaw rad: mm"], shapes),
        "cross": table(["fitted on", "predicted", "residual mm", "its own fit mm", "median fabric mm", "keyframes in their bands",
                        "chance of as many outside"], cross),
        "joint": table(["both trials of", "D N m", "95 % of D", "residuals mm"], joint),
        "fold": fold_table(results["fold"]), "one_bending": one_bending_table(results["one_bending"]), "limits": limits_table(results["limits"])}


def band_of(prediction):
    return [f"{prediction['held']} of {len(prediction['keyframes'])}", f"{prediction['chance']:.3f}"]


def one_bending_table(found):
    names = {"lifts": "both lifts", "fold": "the fold", "all": "lifts and fold"}
    rows = [[what, number(found[name]["best"]["parameters"]["bending"]), finding_text(found[name], "bending"),
             " / ".join(mm(recording["score"]) for recording in found[name]["recordings"]),
             "; ".join(warning.split(": the intervals")[0] for warning in found[name]["warnings"] if "contradict" in warning) or "-"]
            for name, what in names.items()]
    held, chance = band_of(found["band"])
    rows.append(["the fold, predicted from the lifts", "-", "-", mm(found["band"]["score_m"]),
                 f"{held} keyframes in their bands, chance {chance}"])
    return table(["of", "D N m", "95 % of D", "residuals mm", "what is said"], rows)


def fold_table(fold):
    rows = []
    for value, row in fold["by_bending"].items():
        what = {lifts.MEDIAN_FABRIC: "median fabric", fold["from_lifts"]: "both paper lifts"}.get(value, "-")
        rows.append([number(value), what, mm(row["score_m"]), f"{row['start_yaw']:+.2f}",
                     " / ".join(mm(row[f"offset_{axis}"], 0) for axis in "xyz"), row["bounds_hit"] or "-"])
    return table(["D N m", "from", "residual mm", "start yaw rad", "offset x / y / z mm", "at a bound"], rows)


def fold_models_table(models):
    rows = []
    for found in models:
        seen = [frame for frame in found["frames"] if frame["weight"] > 0]
        rows.append([found["clip"], found["model"], number(found["bending"]), f"{found['yields']:g}" if found["yields"] else "never",
                     "yes" if found["layers"] else "no", mm(found["score"]), mm(seen[-1]["score"]), f"{found['start_yaw']:+.2f}",
                     ", ".join(map(str, found["pierced"])) or "none", f"{100 * found['unconverged_share']:.1f}"])
    return table(["clip", "bending model", "D N m", "yields at 1/m", "self-contact", "residual mm", "last keyframe mm",
                  "start yaw rad", "keyframes in which it passes through itself", "unsolved steps %"], rows)


def limits_table(limits):
    rows = []
    for clip, found in limits.items():
        best = found["search"]["best"]["score_on_mesh"]
        pierced = [frame for frame, count in found["piercings"].items() if count > 0]
        rows += [
            [clip, "as fitted", mm(best)],
            [clip, "own offset, yaw and clock for every keyframe", mm(found["free_pose"])],
            [clip, "table height " + profile_text(found["table"], "table_height", 1000, "mm"), ""],
            [clip, "friction " + profile_text(found["table"], "friction", 1, ""), ""],
            [clip, "pinch depth " + profile_text(found["pinch"], "grasp_depth", 1000, "mm"), ""],
            [clip, "pinch pitch " + profile_text(found["pinch"], "grasp_pitch", 1, "rad"), ""],
            [clip, "near the grasp / middle / far end of the sheet (frames 12, 16, 20, 24)",
             " / ".join(mm(x, 1) for x in found["zones"])],
            [clip, "keyframes in which the simulated sheet passes through itself away from the grasp",
             ", ".join(map(str, pierced)) or "none"]]
    for row in rows:
        if not row[2]:
            row[1], row[2] = row[1].rsplit("=", 1)
    return table(["clip", "what", "residual mm"], rows)


def profile_text(search, name, scale, unit):
    found = lifts.profile(search["rows"], name)
    values = " / ".join(f"{scale * value:g}" for value, _ in found)
    return f"{values} {unit}".rstrip() + "=" + " / ".join(mm(score) for _, score in found)


def twin_table(fits):
    rows = []
    for (twin, model, pattern), search in fits.items():
        nominal, noise = twins.TWINS[twin]
        finding = search["parameters"]["bending"]
        rows.append([twin, model, pattern, number(finding["estimate"]), f"{finding['estimate'] / nominal:.2f}",
                     finding_text(search, "bending"), mm(search["best"]["score_on_mesh"]), mm(twins.trimmed_noise(noise))])
    return table(["recording", "bending model", "diagonals", "D N m", "D / nominal", "95 % of D", "residual mm",
                  "of noise alone mm"], rows)


def twin_tables(fits, both, horizons):
    stiffness = [[pattern, *(f"{twins.pattern_stiffness(pattern, angle):.2f}"
                             for angle in (0, math.pi / 4, math.pi / 2))] for pattern in twins.PATTERNS]
    return {"twins": twin_table(fits),
            "patterns": table(["diagonals", "bent along an edge", "along the diagonal", "along the other edge"],
                              stiffness),
            "both": table(["recording", "E Pa", "95 % of E", "D N m", "95 % of D"],
                          [[twin, *(text for name in ("young", "bending")
                                    for text in (number(search["parameters"][name]["estimate"]), finding_text(search, name)))]
                           for twin, search in both.items()]),
            "horizons": table(["bending model", "diagonals", "predictable until s"],
                              [[*fit, "3, the end" if until is None else f"{until:.2f}"]
                               for fit, until in horizons.items()])}


def held_of_claims(row):
    """"29, 94 %": a share of the claims, not of the twins."""
    return f"{row['held']}, {100 * row['held'] / row['claims']:.0f} %" if row["claims"] else "-"


def synthetic_tables(experiments, coverage):
    rows = [[what, name, f"{seeds}", f"{right}", f"{held}", "-" if math.isnan(error) else f"{100 * error:.1f}"]
            for what, name, seeds, right, held, error in experiments]
    twins_rows = [[row["name"], str(row["twins"]), str(row["claims"]), str(row["one_sided"]), held_of_claims(row),
                   "-" if math.isnan(row["factor"]) else f"{row['factor']:.2f}", f"{100 * row['error']:.0f}"] for row in coverage]
    return {"experiments": table(["experiment", "asked", "seeds", "right", "inside their interval", "largest error %"], rows),
            "coverage": table(["parameter", "twins", "claims", "of these one-sided", "claims that hold",
                               "median half width, factor", "median error %"], twins_rows)}
