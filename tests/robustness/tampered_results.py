#!/usr/bin/env python3
"""Tampers with the results of a search that flash-sysid made itself, one field at a time, and hands them to export, report
and grid --resume: each must refuse them with exit code 2 and one line that names file and field. What a kill leaves, a last
line that is cut off or missing, --resume finds again. A recording is one trial under whatever name it is given."""
import argparse
import json
import pathlib
import shutil
import sys
import tempfile

import program
from malformed_inputs import ABSENT, Case, complaint, edited, rewritten, verbs, write_sound_files

READERS = ("export", "report", "resume")
TABLES = ("results.csv", "registrations.csv", "keyframes.csv")
AXES = ["--bending", "5e-5,1e-4,2e-4", "--no-solver-check", "--no-horizon", "--quiet"]  # as write_sound_files


def table(name, change):
    """Changes the list of whole lines of a table; the first is the header."""
    def apply(content):
        return b"".join(line + b"\n" for line in change(content.split(b"\n")[:-1]))
    return rewritten(f"run/{name}.csv", apply)


def results(change):
    """Of results.csv; the lines after the header are ids 0, 1 and 2."""
    return table("results", change)


def field(name, value, line=2, file="results"):
    """Another value in the column `name` of a line."""
    def change(text):
        words = text[line].split(b",")
        words[text[0].split(b",").index(name.encode())] = value.encode()
        return [*text[:line], b",".join(words), *text[line + 1:]]
    return table(file, change)


def both(*damages):
    def damage(folder):
        for each in damages:
            each(folder)
    return damage


def table_cases(verb):
    """results.csv, which all three read."""
    yield Case(f"{verb}: a line twice", verb, results(lambda text: [*text, text[2]]), "results.csv:5", "id", "once")
    yield Case(f"{verb}: an id twice, with another score", verb,
               both(results(lambda text: [*text, text[2]]), field("score_m", "0.001", 4)), "results.csv:5", "once")
    yield Case(f"{verb}: an id for two values", verb, field("id", "0"), "results.csv:3")
    for value in ("3", "-1", "1e9", "2147483648", "99999999999999999999", "0.5", "", "nan", "0x1", "one"):
        yield Case(f"{verb}: id \"{value}\"", verb, field("id", value), "results.csv:3", "id")
    yield Case(f"{verb}: a line cut in the middle", verb,
               results(lambda text: [*text[:2], text[2][:len(text[2]) // 2], *text[3:]]), "results.csv:3", "fields")
    yield Case(f"{verb}: a line too long", verb, results(lambda text: [*text[:3], text[3] + b",0"]), "results.csv:4",
               "fields")
    yield Case(f"{verb}: no header", verb, results(lambda text: text[1:]), "results.csv")
    if verb != "resume":
        yield Case(f"{verb}: empty", verb, rewritten("run/results.csv", lambda _: b""), "results.csv", "--resume")
    yield Case(f"{verb}: removed", verb, rewritten("run/results.csv", None), "results.csv")
    yield Case(f"{verb}: zero bytes", verb, rewritten("run/results.csv", lambda content: content + bytes(4096)),
               "results.csv:5")
    for value in ("maybe", "TRUE", "1", ""):
        yield Case(f"{verb}: converged \"{value}\"", verb, field("converged", value), "results.csv:3", "converged",
                   "true or false")
    yield Case(f"{verb}: not converged, status ok", verb, field("converged", "false"), "results.csv:3", "converged", "status")
    yield Case(f"{verb}: converged, status unconverged", verb, field("status", "unconverged"), "results.csv:3", "converged",
               "status")
    yield Case(f"{verb}: converged, status diverged", verb, field("status", "diverged"), "results.csv:3", "converged",
               "status")
    for name, value in (("score_m", "null"), ("score_m", "nan"), ("score_m", "-5"), ("score_m", "inf"), ("bending", "1"),
                        ("residual_max", "-1"), ("yaw_rad", "inf"), ("status", "")):
        yield Case(f"{verb}: {name} \"{value}\"", verb, field(name, value), "results.csv:3", name)
    for name, value in (("penetration_max_m", "0.5"), ("digest", ""), ("digest", "0123456789abcdef")):
        yield Case(f"{verb}: {name} \"{value}\"", verb, field(name, value), "results.csv:3", "digest", "was edited")


def score_cases(verb):
    """registrations.csv, a line a candidate, and keyframes.csv, as many lines for each."""
    registrations, keyframes = "registrations", "keyframes"

    def without(line):
        return lambda text: [*text[:line], *text[line + 1:]]

    def twice(line):
        return lambda text: [*text[:line + 1], *text[line:]]

    yield Case(f"{verb}: a registration missing", verb, table(registrations, without(2)), "registrations.csv:3", "id")
    yield Case(f"{verb}: a registration twice", verb, table(registrations, twice(2)), "registrations.csv:4", "id")
    yield Case(f"{verb}: a registration more", verb, table(registrations, twice(3)), "registrations.csv:5", "id")
    yield Case(f"{verb}: a keyframe missing", verb, table(keyframes, without(1)), "registrations.csv:2", "score_m")
    yield Case(f"{verb}: a keyframe of a later candidate missing", verb, table(keyframes, lambda text: without(len(text) - 2)(text)),
               "keyframes.csv", ": t: found")
    yield Case(f"{verb}: a keyframe more", verb, table(keyframes, lambda text: twice(len(text) - 1)(text)), "keyframes.csv", "no more")
    yield Case(f"{verb}: a keyframe without points", verb, table(keyframes, lambda text: [*text[:-1], text[-1].rsplit(b",", 2)[0] + b",0,1"]),
               "keyframes.csv", "points", "found \"0\"")
    yield Case(f"{verb}: another score of a keyframe", verb, field("score_m", "0.5", 1, keyframes), "registrations.csv:2", "score_m")
    yield Case(f"{verb}: another score of a registration", verb, field("score_m", "0", 2, registrations), "registrations.csv:3",
               "score_m", "the mean of its keyframes.csv")
    yield Case(f"{verb}: another recording", verb, field("recording", "b", 2, registrations), "registrations.csv:3", "recording")
    yield Case(f"{verb}: a residual that has not converged", verb, field("residual_max", "99999999999999999999"),
               "results.csv:3", "residual_max", "tolerance of 0.001")
    if verb == "resume":
        return
    for name in (registrations, keyframes):
        yield Case(f"{verb}: {name}.csv without lines", verb, table(name, lambda text: text[:1]), f"{name}.csv",
                   "candidate 0")
        yield Case(f"{verb}: {name}.csv without its last line", verb, table(name, lambda text: text[:-1]), f"{name}.csv",
                   "candidate 2", "--resume")


def copied(*files):
    """Files of another search over the same axes."""
    return both(*(lambda folder, file=file: shutil.copy(folder / "other" / file, folder / "run" / file) for file in files))


def exchanged(folder):
    """Candidates 0 and 2 in all tables, but for the values of the grid."""
    def change(ids):
        return lambda text: [text[0], *(line for number in (b"0", b"1", b"2") for line in text[1:]
                                        if ids.get(line.split(b",")[0], line.split(b",")[0]) == number)]

    for name in ("results", "registrations", "keyframes"):
        kept = 2 if name == "results" else 1
        path = folder / "run" / f"{name}.csv"
        text = path.read_bytes().split(b"\n")[:-1]
        heads = {line.split(b",")[0]: line.split(b",")[:kept] for line in text[1:]}
        ids = {b"0": b"2", b"2": b"0"}
        table(name, change(ids))(folder)
        table(name, lambda lines: [lines[0], *(b",".join([*heads[ids.get(line.split(b",")[0], line.split(b",")[0])],
                                                          *line.split(b",")[kept:]]) for line in lines[1:])])(folder)


def digest_cases(verb):
    """What agrees with all else that the tables say."""
    yield Case(f"{verb}: tables of another search", verb, copied(*TABLES), "results.csv:2", "digest", "another search")
    yield Case(f"{verb}: candidates exchanged", verb, exchanged, "results.csv:2", "digest", "another search")
    yield Case(f"{verb}: another bound hit", verb, field("bounds_hit", "yaw", 3, "registrations"), "results.csv:4", "digest")
    if verb == "resume":  # which writes the summary
        return
    yield Case(f"{verb}: summary of another search", verb, copied("summary.json"), "summary.json", "results_digest")
    yield Case(f"{verb}: a candidate missing in all tables", verb,
               both(*(table(name, lambda text: [line for line in text if not line.startswith(b"2,")])
                      for name in ("results", "registrations", "keyframes"))), "summary.json", "results_digest", "--resume")
    for place, value in (("wall_seconds", 1), ("unconverged", 1), ("warnings", ["mine"]), ("digest", ABSENT), ("results_digest", ABSENT)):
        yield Case(f"{verb}: {place} {value}", verb, edited("run/summary.json", place, value), "summary.json: digest")


def summary_cases(verb):
    file, bending = "run/summary.json", "parameters.bending."
    decided = both(edited(file, bending + "identifiable", "yes"), edited(file, bending + "interval95", [6e-5, 1.5e-4]),
                   edited(file, bending + "estimate", 1e-4))
    for place in ("estimate", "interval95"):
        yield Case(f"{verb}: {place} null", verb, both(decided, edited(file, bending + place, None)), "summary.json",
                   f"bending.{place}", "found null")
    for place, value in ((bending + "estimate", "1e-4"), (bending + "estimate", 5.0), (bending + "interval95", [None, None]),
                         (bending + "identifiable", None), (bending + "profile.values", [None, None, None]),
                         ("best.parameters.bending", None), ("best.score", None), ("best.membrane_stiffness", None),
                         ("recordings.0.score", None), ("candidates", None), ("exit_code", None), ("warnings", [None])):
        last = [part for part in place.split(".") if not part.isdigit()][-1]
        yield Case(f"{verb}: {place} {json.dumps(value)}", verb, both(decided, edited(file, place, value)), "summary.json",
                   last)


def grid_cases(verb):
    """grid.json, with fields of other types."""
    for place, value in (("schema", 5), ("axes", "x"), ("axes", [5]), ("axes.0.name", 5), ("axes.0.values", ["x"]), ("axes.0.values", []),
                         ("axes.0.log", "yes"), ("recordings", 5), ("recordings", [5]), ("fingerprint", "x"),
                         ("fingerprint", {"a": 1})):
        yield Case(f"{verb}: grid.json {place} {json.dumps(value)}", verb, edited("run/grid.json", place, value), "grid.json: ",
                   place.split(".")[-1])


def fit_cases():
    for name in ("registrations", "keyframes"):
        yield Case(f"fit: {name}.csv without its last line", "fit", table(name, lambda text: text[:-1]), f"{name}.csv",
                   "candidate 2", "--resume")


def cases(fits):
    yield from fit_cases() if fits else ()
    for verb in READERS:
        yield from table_cases(verb)
        yield from score_cases(verb)
        yield from digest_cases(verb)
        yield from grid_cases(verb)
        if verb != "resume":  # which writes the summary
            yield from summary_cases(verb)
            yield Case(f"{verb}: the last line cut off", verb,
                       rewritten("run/results.csv", lambda content: content[:-9]), "results.csv", "cut off")
            yield Case(f"{verb}: a line missing", verb, results(lambda text: [*text[:2], *text[3:]]), "registrations.csv:3", "id",
                       "results.csv")


def resumed(sysid, sound, work):
    """What a kill leaves is found again, to the same files."""
    commands = verbs(sysid, None)
    for name, damage in (("last line cut off", rewritten("run/results.csv", lambda content: content[:-9])),
                         ("last line missing", results(lambda text: text[:-1])),
                         ("keyframes without a result", both(results(lambda text: text[:-1]),
                                                             rewritten("run/keyframes.csv", lambda c: c[:-9]))),
                         ("keyframes.csv without its last line", table("keyframes", lambda text: text[:-1])),
                         ("keyframes.csv without half of its lines", table("keyframes", lambda text: text[:len(text) // 2])),
                         ("registrations.csv without its last line", table("registrations", lambda text: text[:-1])),
                         *((f"{file} without a byte", rewritten(f"run/{file}", lambda _: b"")) for file in TABLES),
                         ("keyframes.csv without lines", table("keyframes", lambda text: text[:1])),
                         ("lines that end in CRLF", rewritten("run/results.csv", lambda c: c.replace(b"\n", b"\r\n"))),
                         ("summary of another search", copied("summary.json"))):
        folder = work / "killed"
        program.renew(sound, folder)
        damage(folder)
        done = program.call(*commands["resume"](folder), "--quiet")
        yield done.returncode in (0, 3), f"resume, {name}: exit code {done.returncode}: {done.stderr}"
        for file in TABLES:
            yield ((folder / "run" / file).read_bytes() == (sound / "run" / file).read_bytes(),
                   f"resume, {name}: another {file}")
        done = program.call(*commands["report"](folder), "--quiet")
        yield done.returncode == 0, f"resume, {name}, then report: exit code {done.returncode}: {done.stderr}"


def renamed_copies(sysid, sound, work):
    def copy(name, change):
        folder = work / name
        shutil.copytree(sound / "recording", folder)
        path = folder / "recording.json"
        content = json.loads(path.read_text())
        change(content, folder)
        path.write_text(json.dumps(content))
        return folder

    def other_name(content, folder):
        content["name"] = "another"

    def other_files(content, folder):
        other_name(content, folder)
        for k, keyframe in enumerate(content["keyframes"]):
            (folder / keyframe["cloud"]).rename(folder / f"{k}.ply")
            keyframe["cloud"] = f"{k}.ply"
        (folder / "gripper.tum").rename(folder / "arm.tum")
        content["trajectories"]["gripper"] = "arm.tum"

    def other_settings(content, folder):
        other_name(content, folder)
        content["nuisance"] = {"offset_m": [0.01, 0.01, 0.01]}
        content["crop"] = {"min": [None, None, -0.01], "max": [None, None, None]}
        content["grasps"][0]["shape"] = "point"

    def other_robot_file(content, folder):
        other_name(content, folder)
        path = folder / "gripper.tum"
        path.write_text("# the arm\n" + path.read_text())

    for name, change in (("name", other_name), ("files", other_files), ("settings", other_settings),
                         ("robot file", other_robot_file)):
        both_given = [sound / "recording", copy(name.replace(" ", "_"), change)]
        for verb, more in (("grid", AXES), ("plan", [])):
            out = work / "twice"
            done = program.call(sysid, verb, *both_given, "--asset", sound / "asset.json", *more, "-o", out)
            yield done.returncode == 2, f"{verb}, a copy of other {name}: exit code {done.returncode}: {done.stderr}"
            yield "is the same recording as" in done.stderr, f"{verb}, a copy of other {name}: {done.stderr}"
            yield not out.exists(), f"{verb}, a copy of other {name}: leaves {out}"
            shutil.rmtree(out, ignore_errors=True) if out.is_dir() else out.unlink(missing_ok=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sysid", required=True, help="the program flash-sysid")
    parser.add_argument("--sim", required=True, help="the program flash-sim")
    options = parser.parse_args()
    done, wrong = 0, []
    with tempfile.TemporaryDirectory() as temporary:
        work = pathlib.Path(temporary)
        sound = work / "sound"
        write_sound_files(options.sysid, options.sim, sound)
        program.call(options.sysid, "grid", sound / "recording", "--asset", sound / "asset.json", *AXES, "--hold",
                     "friction=0.5:measured", "-o", sound / "other")
        commands = verbs(options.sysid, options.sim) | {
            "fit": lambda f: [options.sysid, "fit", f / "recording", "--start", f / "run", "-o", f / "fitted"]}
        for case in cases("fit" in program.call(options.sysid, "--help").stdout):
            done += 1
            found = complaint(case, commands, sound, work)
            wrong += [f"{case.name}: {found}"] if found else []
        for check in (resumed, renamed_copies):
            for holds, what in check(options.sysid, sound, work):
                done += 1
                wrong += [] if holds else [what]
    print("\n".join([*wrong, f"{done - len(wrong)} of {done} statements about tampered results and copies hold"]))
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
