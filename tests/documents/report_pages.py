"""What a report has to show, held against the JSON beside it: the words, the tables and the pictures have the same numbers."""
import json
import math
import pathlib
import re

import browser


def numbers(text):
    """All numbers in a text as reports write them: 1.5 × 10−4, 12,345, −0.3."""
    found = re.findall(r"([-−]?\d[\d,]*(?:\.\d+)?)(?:\s*×\s*10\s*([-−]?\d+))?", text)
    return [float(a.replace("−", "-").replace(",", "")) * 10.0 ** int((b or "0").replace("−", "-")) for a, b in found]


def near(a, b, digits=3):
    """Equal but for rounding to so many digits."""
    return math.isclose(a, b, rel_tol=0.6 * 10.0 ** (1 - digits), abs_tol=1e-12)


def rounded(a, b, decimals):
    return abs(a - b) <= 0.51 * 10.0 ** -decimals


def of_any(page, seen):
    """Statements on every report: (holds, complaint)."""
    yield not seen["log"], f"{page}: its console says {seen['log'][:3]}"
    yield not seen["broken"], f"{page}: pictures that are none: {seen['broken'][:3]}"
    yield seen["wide"] <= 0, f"{page}: {seen['wide']} px wider than the window"
    bad = re.search(r".{0,40}(?:\bNaN\b|\bundefined\b|\bInfinity\b|\[object|@[A-Z]+@).{0,40}", seen["text"])
    yield not bad, f"{page}: says {bad and bad[0]}"
    for section in seen["sections"]:
        yield not section["shown"] or section["text"] + section["drawn"] > 0, f"{page}: nothing in section {section['title'] or section['id']}"
    dashes = {shape.get("dash") for plot in seen["plots"].values() for shape in plot["shapes"]}
    yield "Dashed:" not in seen["text"] or "dash" in dashes, f"{page}: speaks of a dashed line, and has none"
    for name, plot in seen["plots"].items():
        yield not plot["shown"] or plot["drawn"] > 0, f"{page}: plot {name} is not drawn"


def of_search(page):
    """Statements on the report of flash-sysid in the folder of a search."""
    page = pathlib.Path(page)
    seen, summary = browser.probed(page), json.loads((page.parent / "summary.json").read_text())
    yield from of_any(page, seen)
    rows, plots, found = seen["rows"], seen["plots"], summary["parameters"]
    yield len(rows["answer"]) == 1 + len(found) + len(summary["fixed"]), f"{page}: {len(rows['answer'])} rows of parameters"
    score = f"{1000 * summary['best']['score']:.2f} mm"
    yield summary["exit_code"] == 3 or score in seen["text"].split("\n\n")[0] + seen["text"][:1500], f"{page}: its first lines do not say {score}"
    colours = {"yes": "rgba(26,127,75", "lower_bound": "rgba(197,138,0", "upper_bound": "rgba(197,138,0"}
    with_profile = [name for name in found if len(found[name]["profile"]["values"]) > 1]
    for row, (name, finding) in zip(rows["answer"][1:], found.items()):
        interval, told = finding["interval95"], finding["identifiable"]
        if told == "yes" and not summary["by_points"]:
            yield near(numbers(row[1])[0], finding["estimate"]), f"{page}: {name} is {row[1]}, summary.json has {finding['estimate']}"
            yield all(map(near, numbers(row[2]), interval)), f"{page}: interval of {name} is {row[2]}, summary.json has {interval}"
        yield ("not identifiable" in row[4]) == (told == "no") and ("bound only" in row[4]) == told.endswith("bound"), \
            f"{page}: verdict of {name} is {row[4]}, summary.json has {told}"
        if name not in with_profile:
            continue
        plot, profile = plots[f"profile-{with_profile.index(name)}"], finding["profile"]
        trace = plot["traces"][0]
        same = len(trace["y"]) == len(profile["scores"]) and all(
            a is None and b is None or rounded(a, 1000 * b, 6) for a, b in zip(trace["y"], profile["scores"]))
        yield trace["x"] == profile["values"] and same, f"{page}: the profile of {name} is not that of summary.json"
        shaded = [[shape["x0"], shape["x1"]] for shape in plot["shapes"] if shape["type"] == "rect"]
        yield shaded == ([interval] if interval and told != "no" else []), f"{page}: profile of {name} is shaded over {shaded}, not {interval}"
        yield told == "no" or plot["shapes"][0]["fill"].startswith(colours[told]), f"{page}: {name} is {told}, and shaded {plot['shapes']}"
    for trace, recording, row in zip(plots["residual"]["traces"], summary["recordings"], rows["recordings"][1:]):
        frames = [frame["score"] for frame in recording["frames"]]
        yield len(trace["y"]) == len(frames) and all(a is None or rounded(a, 1000 * b, 6) for a, b in zip(trace["y"], frames)), \
            f"{page}: residuals of {recording['name']} are not those of summary.json"
        hollow = [colour == "#fff" for colour in trace["color"]]
        yield hollow == [frame["weight"] <= 0 for frame in recording["frames"]], f"{page}: hollow are other keyframes than those dropped"
        yield row[0] == recording["name"] and rounded(numbers(row[1])[0], 1000 * recording["score"], 2), f"{page}: recordings: {row[:2]}"
    if plots.get("map", {}).get("shown"):
        yield from of_map(page, plots["map"]["traces"], page.parent / "results.csv")
    if plots.get("view", {}).get("shown"):
        mesh, cloud = plots["view"]["traces"]
        said = re.search(r"t = ([\d.]+) s · ([\d.]+) mm", seen["text"])
        frames = summary["recordings"][0]["frames"]
        yield len(mesh["x"]) > 3 and len(cloud["x"]) > 0, f"{page}: the replay shows {len(mesh['x'])} vertices and {len(cloud['x'])} points"
        yield said and any(rounded(frame["t"], float(said[1]), 2) and frame["score"] is not None
                           and rounded(1000 * frame["score"], float(said[2]), 1) for frame in frames), \
            f"{page}: the clock says {said and said[0]}, no keyframe of summary.json"


def of_map(page, traces, table):
    """The score map has each cell's best score, and its cross is on the best of them."""
    lines = [line.split(",") for line in table.read_text().splitlines()]
    k = lines[0].index("score_m")
    scores = [1000 * float(line[k]) for line in lines[1:] if line[lines[0].index("status")] == "ok"]
    if traces[0]["type"] == "heatmap":
        cells = {(x, y): z for y, row in zip(traces[0]["y"], traces[0]["z"]) for x, z in zip(traces[0]["x"], row) if z is not None}
    else:
        cells = dict(zip(zip(traces[0]["x"], traces[0]["y"]), traces[0]["color"]))
    yield rounded(min(cells.values()), min(scores), 6), f"{page}: the map's least is {min(cells.values())} mm, results.csv has {min(scores)}"
    cross = traces[1]["x"][0], traces[1]["y"][0]
    yield cells.get(cross) == min(cells.values()), f"{page}: the cross of the map is at {cross}, not at its least"


def of_camera(page):
    """Statements on the report of flash-calib handeye beside its JSON."""
    page = pathlib.Path(page)
    seen, answer = browser.probed(page), json.loads(page.with_suffix(".json").read_text())
    yield from of_any(page, seen)
    rows, sd = seen["rows"], answer["predicted_sd"]
    for axis, (row, place, parent) in enumerate(zip(rows["transform"][1:4], answer["transform"]["translation"], sd["translation_parent_mm"])):
        yield rounded(numbers(row[1])[0], 1000 * place, 2) and rounded(numbers(row[2])[0], parent, 2), f"{page}: along {'xyz'[axis]} it says {row[1:3]}"
    used = [view for view in answer["views"] if view["used"]]
    lead = seen["text"][:1500]
    yield f"{len(used)} of {len(answer['views'])} views" in lead, f"{page}: its first lines do not say how many views were used"
    yield (answer["exit_code"] == 3) == ("cannot be used" in lead), f"{page}: exit code {answer['exit_code']}, and it says: {lead[:200]}"
    away = math.hypot(*sd["translation_mm"])
    yield answer["exit_code"] == 3 or f"known to {away:.{2 if away < 1 else 1}f} mm" in lead, f"{page}: does not say {away} mm"
    for warning in answer["warnings"]:
        yield warning[1:].rstrip(".") in seen["text"], f"{page}: does not say: {warning}"
    for method, row in zip(answer["comparison"].values(), rows["comparison"][1:]):
        yield row[-1] == "wild" if method["wild"] else row[-1] in ("", "the answer"), f"{page}: method {row}"
    yield rows["comparison"][-1][-1] == "the answer", f"{page}: the last method is not the answer: {rows['comparison'][-1]}"
    for view, row in zip(answer["views"], rows["views"][1:]):
        yield row[0] == view["image"] and row[-1].startswith("left out") != view["used"], f"{page}: view {row}"
    worst = [view["image"] for view in sorted(used, key=lambda view: -(view.get("chain_px") or 0))]
    shown = [figure["caption"].split()[0] for figure in seen["figures"] if not figure["paths"]]
    shown = [image for image in shown if image in worst]
    yield shown == worst[:len(shown)], f"{page}: the worst views are {worst[:3]}, it shows {shown[:3]} first"
    # Each frame of arrows has the rms that stands below it.
    drawn = [figure for figure in seen["figures"] if len(figure["paths"]) == 2]
    with_corners = [view for view in used if view.get("chain_px") is not None]
    yield len(drawn) == len(with_corners), f"{page}: {len(drawn)} frames of arrows for {len(with_corners)} views"
    magnified = re.search(r"arrows ([\d.]+) times", seen["text"])
    for figure in drawn:
        # Of three strokes an arrow the first is its shaft.
        arrows = re.findall(r"M([-\d.e]+),([-\d.e]+)L([-\d.e]+),([-\d.e]+)", figure["paths"][1])[::3]
        lengths = [math.hypot(float(c) - float(a), float(d) - float(b)) / float(magnified[1]) for a, b, c, d in arrows]
        rms = math.sqrt(sum(x * x for x in lengths) / max(1, len(lengths)))
        said = float(re.search(r"([\d.]+) px", figure["caption"])[1])
        yield arrows and abs(rms - said) < 0.006 + 0.01 * said, f"{page}: {figure['caption']} stands below arrows of {rms:.4f} px rms"
