"""The recorded lifts: what fits them, what one trial says about the other, what is left."""
import json
import math
import shutil

import surface

MESH = "sheet:0.278x0.278:0.02"
MEDIAN_FABRIC = 1.4e-5  # flexural rigidity of a median fabric at 0.2 kg/m^2 [N m]
# E t, nu, weight and friction are assumed: nobody weighed the cloths.
ASSET = {"schema": "flash-asset/1", "mesh": MESH, "element_type": "TRIANGLE",
         "mechanical_props": {"areal_density": 0.2, "young": 100, "poisson": 0.3, "constitutive": "TRI_COROTATED",
                              "bending_rigidity": MEDIAN_FABRIC, "friction": 0.4}}
GRASPS = {"clamp": ["--grasp-shape", "clamp", "--grasp-within", "0.021"],
          "point": ["--grasp-shape", "point", "--grasp-within", "0.021"],
          "pinch": ["--grasp-shape", "pinch", "--hold", "grasp_depth=0.021:measured"]}
STIFF = {"bending": "2e-4,5e-4,1e-3,2e-3", "start-yaw": "0.1,0.2,0.28,0.35"}
LIMP = {"bending": "3e-6,1e-5,3e-5,1e-4", "start-yaw": "-0.05,0.05,0.15,0.25"}
# `floor`: how far the other trial of the same fabric is away, `independent`: what another converged solver
# reached on the clip; both are given with the recordings [mm]. The second trial of a limp fabric takes the grasp
# shape of the first.
CLIPS = {
    "lift_paper": {"axes": STIFF, "grasps": list(GRASPS), "floor": 2.8, "independent": "5.3"},
    "lift_paper2": {"axes": STIFF, "grasps": list(GRASPS), "floor": 2.7, "independent": "5.1"},
    "lift_navy": {"axes": LIMP, "grasps": list(GRASPS), "floor": 2.6, "independent": "8.9"},
    "lift_navy2": {"axes": LIMP, "grasps": ["pinch"], "floor": 2.7, "independent": "9.3"},
    "lift_tan": {"axes": {"bending": "3e-5,1e-4,3e-4,1e-3", "start-yaw": "-0.15,0,0.15"},
                 "grasps": ["clamp", "pinch"], "independent": "11.4"},
    "lift_redblack2": {"axes": {"bending": "3e-5,1e-4,3e-4,1e-3", "start-yaw": "-0.15,0,0.15"},
                       "grasps": ["clamp", "pinch"], "from": "1.1", "independent": "6.4"},
}
CHECKED = ("lift_paper", "lift_paper2", "lift_navy")  # the best candidate is solved again under finer settings
FOLD_BENDING = (1.1e-3, 1e-4)  # of both paper lifts, and what the fold asks for [N m]
FOLD_YIELDS = (5, 20)  # assumed: nobody measured where a paper towel yields [1/m]
FOLD_YAWS = (-0.3, -0.2, -0.1, 0.0)
NAVY_BENDING = 3.8e-6  # of its own fit [N m]
NAVY_YAWS = (-0.05, 0.06, 0.15, 0.25)
PAIRS = {"paper": ("lift_paper", "lift_paper2"), "navy": ("lift_navy", "lift_navy2")}


def write_asset(out, name="cloth", **properties):
    path = out / f"{name}.json"
    path.write_text(json.dumps(ASSET | {"mechanical_props": ASSET["mechanical_props"] | properties}, indent=2) + "\n")
    return str(path)


def window(clip):
    """Keyframes 10 to 24; the trimmed mean is the default. The tolerance is a hundredth of the default: on the way to its folds
    a limp cloth takes one of several ways, and at 1e-3 rounding decides which."""
    return ["--from", CLIPS.get(clip, {}).get("from", "1.0"), "--until", "2.4", "--mesh", MESH, "--tolerance", "1e-5"]


SEARCH = ("--no-plan",)  # what to record next is not asked


def axes(ranges):
    return [f"--{name}={values}" for name, values in ranges.items()]


def grasp_of(search):
    """Options of a replay (no axes, no fixed constants) and the parameters for --hold of the best candidate."""
    shape = search["grasp"]
    options = [word for word in GRASPS[shape] if word != "--hold" and "=" not in word]
    names = ("bending", "start_yaw", "young", "grasp_depth")
    return options, {name: search["best"]["parameters"][name] for name in names
                     if name in search["best"]["parameters"]}


def fit(runs, data, asset, clip):
    """Grasp shape, start yaw and D first; then D against E t at the best grasp and start yaw."""
    shapes = {}
    for shape in CLIPS[clip]["grasps"]:
        shapes[shape] = runs.grid(f"{clip}/{shape}", [data / "lift" / clip], "--asset", asset, *SEARCH, *window(clip),
                                  *GRASPS[shape], *axes(CLIPS[clip]["axes"]), "--no-solver-check")
        shapes[shape]["grasp"] = shape
    best = min(shapes.values(), key=lambda search: search["best"]["score_on_mesh"])
    parameters = best["best"]["parameters"]
    stiffness = parameters["bending"]
    material = runs.grid(
        f"{clip}/material", [data / "lift" / clip], "--asset", asset, *SEARCH, *window(clip), *GRASPS[best["grasp"]],
        "--hold", f"start_yaw={parameters['start_yaw']!r}", "--young", "30,100,300",
        f"--bending={stiffness / 4!r}:{stiffness * 4!r}:5:log",
        *(["--repeatability", repr(CLIPS[clip]["floor"] / 1000)] if "floor" in CLIPS[clip] else []),
        *([] if clip in CHECKED else ["--no-solver-check"]))
    material["grasp"] = best["grasp"]
    return {"shapes": shapes, "material": material}


def best_replay(runs, data, asset, clip, search, name="best_replay", frames="12,16,20,24"):
    """The best candidate again, with pictures of these frames."""
    options, parameters = grasp_of(search)
    return runs.replay(f"{clip}/{name}", data / "lift" / clip, parameters, "--asset", asset, *window(clip), *options,
                       frames=frames)


def predict(runs, data, asset, source, search, target):
    """Material, grasp and start yaw of one trial on the other; only offset, yaw and clock are fitted anew.
    Beside it a median fabric in the same grasp."""
    options, parameters = grasp_of(search)
    common = ["--asset", asset, *window(target), *options]
    recording = data / "lift" / target
    return {"predicted": runs.replay(f"{target}/from_{source}", recording, parameters, *common),
            "band": runs.predict(f"{target}/band_from_{source}", f"{source}/material", recording, *common),
            "median": runs.replay(f"{target}/median_fabric", recording,
                                  {**parameters, "bending": MEDIAN_FABRIC}, *common)}


def fit_pair(runs, data, asset, pair, search):
    """One D for both trials, with the start yaw of the first."""
    found = search["best"]["parameters"]
    stiffness, yaw = found["bending"], found["start_yaw"]
    joint = runs.grid(f"{pair}_joint", [data / "lift" / clip for clip in PAIRS[pair]], "--asset", asset, *SEARCH,
                      *window(PAIRS[pair][0]), *GRASPS[search["grasp"]],
                      f"--bending={stiffness / 4!r}:{stiffness * 4!r}:5:log",
                      "--hold", f"start_yaw={yaw!r}", "--repeatability", "0.0028", "--no-solver-check")
    joint["grasp"] = search["grasp"]
    return joint


def turned(runs, name, recording, yaw):
    """The recording with its sheet turned about where the gripper starts, as a start yaw does."""
    folder = runs.out / name
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(recording, folder)
    path = folder / "recording.json"
    path.chmod(0o644)
    record = json.loads(path.read_text())
    pose = record["object"]["start"]["T_base_object"]
    first = (folder / record["trajectories"]["gripper"]).read_text().split("\n")
    pivot = [float(word) for word in next(line for line in first if line.strip() and not line.startswith("#")).split()[1:4]]
    c, s = math.cos(yaw), math.sin(yaw)
    x, y = pose[0] - pivot[0], pose[1] - pivot[1]
    half_c, half_s = math.cos(yaw / 2), math.sin(yaw / 2)
    qx, qy, qz, qw = pose[3:]
    record["object"]["start"]["T_base_object"] = [
        pivot[0] + c * x - s * y, pivot[1] + s * x + c * y, pose[2],
        half_c * qx - half_s * qy, half_c * qy + half_s * qx, half_c * qz + half_s * qw, half_c * qw - half_s * qz]
    path.write_text(json.dumps(record, indent=1))
    return folder


def lifts_and_fold(runs, data, asset, material, folded):
    """One D for the two lifts of paper, for the fold, and for all three; what the lifts say of the fold. Each recording lies as
    its own search found it, in the grasp of the first."""
    grasp = GRASPS[material["lift_paper"]["grasp"]]
    lying = [turned(runs, f"turned/{clip}", data / "lift" / clip, material[clip]["best"]["parameters"]["start_yaw"])
             for clip in PAIRS["paper"]]
    lying.append(turned(runs, "turned/fold_paper", folded["recording"], folded["search"]["best"]["parameters"]["start_yaw"]))
    options = ["--asset", asset, *window("fold_paper"), *grasp]
    found = {}
    for name, recordings in (("lifts", lying[:2]), ("fold", lying[2:]), ("all", lying)):
        found[name] = runs.grid(f"one_bending/{name}", recordings, *options, *SEARCH, "--bending", "2e-5:4e-3:9:log",
                                "--repeatability", "0.0028", "--no-solver-check")
    found["band"] = runs.predict("one_bending/fold_from_lifts", "one_bending/lifts", lying[2], *options)
    return found


def import_fold(runs, data):
    """The paper towel folded. The recording's start pose points away from its clouds, so it is made anew from clouds and path."""
    clip = data / "lift" / "fold_paper"
    return runs.import_clouds(
        "fold_recording", clip / "frames", "--trajectory", str(clip / "tcp.tum"), "--times", "rate:10", "--mesh", "sheet:0.278x0.278:0.02", "--grasp", "corner", "--grasp-within", "0.021", "--crop-z", "0.085:0.45",
        "--crop-y", ":0.35", "--table-z", "0.07", "--offset-bound", "0.08,0.12,0.06", "--yaw-bound", "0.4", "--time-offset-bound", "0.2",
        "--start-yaw-bound", "0.35", "--kind", "free", "--name", "fold_paper", "--despite-doubts")  # the cloth is folded over the gripper


def fold(runs, data, asset, joint):
    """What the D of the lifts, stiffer and softer ones make of the fold, another motion."""
    recording = import_fold(runs, data)
    from_lifts = joint["best"]["parameters"]["bending"]
    values = sorted({MEDIAN_FABRIC, 1e-4, 2.5e-4, from_lifts})
    search = runs.grid("fold_paper", [recording], "--asset", asset, *SEARCH, *window("fold_paper"), *GRASPS[joint["grasp"]],
                       "--bending", ",".join(map(repr, values)), "--start-yaw=-0.3,-0.2,-0.1,0", "--no-solver-check")
    return {"recording": recording, "search": search, "from_lifts": from_lifts,
            "by_bending": {value: best_row(search["rows"], bending=value) for value in values}}


def fold_models(runs, data):
    """The fold at the D of the lifts and a tenth of it: with and without self-contact, and with bending that yields. The start yaw
    is searched for each. Then the limp lift, which passes through itself, at its own D."""
    assets = {"plate": write_asset(runs.out), "hinge": write_asset(runs.out, "hinged", bending_model="hinge")}
    models = [{"clip": "fold_paper", "model": model, "bending": bending, "yields": yields, "layers": layers}
               for bending in FOLD_BENDING for model, yields in (("plate", None), ("hinge", None), *(("hinge", k) for k in FOLD_YIELDS))
               for layers in (False, True)]
    models += [{"clip": "lift_navy", "model": "plate", "bending": NAVY_BENDING, "yields": None, "layers": layers}
               for layers in (False, True)]
    recordings = {"fold_paper": import_fold(runs, data), "lift_navy": data / "lift" / "lift_navy"}
    return [model | best_yaw(runs, recordings[model["clip"]], assets[model["model"]], model) for model in models]


def best_yaw(runs, recording, asset, model):
    """The best of the start yaws, and in which keyframes that passes through itself away from the grasp."""
    grasp, yaws = (GRASPS["pinch"], NAVY_YAWS) if model["clip"] == "lift_navy" else (GRASPS["clamp"], FOLD_YAWS)
    grasp = [word.removesuffix(":measured") for word in grasp]  # a replay has no intervals
    options = [*grasp, *(["--self-contact", "0.001"] if model["layers"] else [])]
    found = []
    for yaw in yaws:
        name = "fold_models/" + "_".join(f"{value}" for value in [*model.values(), yaw])
        material = {"bending": model["bending"]} | ({"yield_curvature": model["yields"]} if model["yields"] else {})
        timed = [word if word != "1e-5" else "1e-3" for word in window(model["clip"])]  # layers in contact take long to 1e-5
        replay = runs.replay(name, recording, material | {"start_yaw": yaw}, "--asset", asset, *timed, *options)
        found.append(replay | {"start_yaw": yaw, "folder": runs.out / name})
    best = min(found, key=lambda replay: replay["score"])
    pierced = surface.piercings_by_frame(best["folder"], range(10, 25))
    return best | {"pierced": [frame for frame, count in pierced.items() if count]}


def best_row(rows, **wanted):
    """The best of the rows with these values; rows are sorted by score."""
    return next(row for row in rows if all(abs(row[key] - value) <= 1e-6 * abs(value)
                                           for key, value in wanted.items()))


def profile(rows, name):
    """[(value, best score [m] over all else)], by value."""
    values = sorted({row[name] for row in rows})
    return [(value, min(row["score_m"] for row in rows if row[name] == value)) for value in values]
