"""flash-calib on recorded hand-eye sets, each with one command from its files as they are, and on seeded scenes."""
import itertools
import json
import math
import re
import resource
import subprocess
import time

# What OpenCV 4.6 and AprilTag 3.3 gave on the same pictures, as the sets' own README states it: rms of A X = X B (deg, mm)
# by method; 2-D rms per corner [px] of Park, of the bundle with the robot taken as exact, and of the bundle with a
# correction of every robot pose.
BASELINES = {
    "eih_aubo_chessboard": ({"tsai": (1.2, 10.8), "park": (0.45, 3.6), "daniilidis": (0.46, 3.8), "shah": (0.45, 3.7)},
                            (3.21, 0.95, 0.17)),
    "eih_franka_chessboard": ({"tsai": (0.61, 7.8), "park": (0.61, 7.7), "daniilidis": (0.61, 7.8), "shah": (0.61, 7.9)},
                              (5.35, 4.43, 0.50)),
    "eih_robot_cal_tools_circles": ({"tsai": (3.1, 41), "park": (3.1, 41), "daniilidis": (3.1, 41), "shah": (3.1, 45)},
                                    (7.10, 1.94, 0.51)),
    "eth_franka_apriltag": ({"tsai": (124, 118), "park": (1.7, 8.2), "daniilidis": (117, 2672), "shah": (1.7, 8.3)},
                            (6.54, 4.71, 0.34)),
    "eth_robot_cal_tools_charuco": ({"tsai": (51, 534), "park": (1.6, 21), "daniilidis": (1.9, 63), "shah": (1.6, 21)},
                                    (8.46, 2.58, 0.96)),
    "eth_mycobot_aruco_1": ({"tsai": (7.8, 61), "park": (2.3, 17), "daniilidis": (2.7, 31), "shah": (2.3, 17)},
                            (7.34, 1.93, 0.60)),
    "eth_mycobot_aruco_2": ({}, None),
    "pairs_moveit": ({"tsai": (113, None), "park": (0.128, 6.6), "daniilidis": (108, None), "shah": (0.129, 6.6)}, None),
}
METHODS = {"tsai": "Tsai", "park": "Park", "horaud": "Horaud", "andreff": "Andreff", "daniilidis": "Daniilidis",
           "shah": "Shah", "li": "Li", "bundle": "bundle, exact robot", "pose_space": "pose space",
           "errors_in_variables": "errors in variables"}
ARMS = ("eth_mycobot_aruco_1", "eth_mycobot_aruco_2")
CAMERAS = tuple(f"camera{i}" for i in range(1, 5))
# Medians deg, mm of Park, bundle and errors in variables over 60 trials of the same protocol, from the same README.
PROTOCOL = {
    ("eih", 0.0): ((0.028, 0.30), (0.005, 0.026), (0.005, 0.026)),
    ("eih", 0.05): ((0.040, 0.51), (0.30, 1.68), (0.035, 0.45)),
    ("eih", 0.1): ((0.076, 0.89), (0.59, 3.31), (0.070, 0.88)),
    ("eth", 0.0): ((0.21, 3.65), (0.012, 0.175), (0.012, 0.175)),
    ("eth", 0.05): ((0.22, 3.55), (0.106, 1.34), (0.073, 0.76)),
    ("eth", 0.1): ((0.21, 3.83), (0.20, 2.62), (0.115, 1.41)),
}
TRIALS, BLOCKS = 60, 10
FIRST_SEED = 6001  # nothing was chosen by seeds from here on


class Calibrations:
    """Runs of flash-calib in `out`; none is kept, all together take less than two minutes."""

    def __init__(self, program, out):
        self.program = str(program)
        self.out = out
        self.out.mkdir(parents=True, exist_ok=True)

    def run(self, name, *command):
        """What the command writes to NAME.json, with `seconds` of processor time; or {"error": its last line}."""
        path = self.out / f"{name}.json"
        path.unlink(missing_ok=True)
        used, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
        done = subprocess.run([self.program, *map(str, command), "--quiet", "--force", "-o", str(path)],
                              capture_output=True, text=True)
        seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - used.ru_utime
        print(f"{time.monotonic() - begin:6.0f} s  {name}", flush=True)
        if not path.exists():
            return {"error": (done.stderr.strip().splitlines() or ["no answer"])[-1]}
        return json.loads(path.read_text()) | {"seconds": seconds}


def run(program, data, out, study):
    runs = Calibrations(program, out)
    sets = {name: runs.run(name, "handeye", data / name, *(["--setup", "eye-to-hand"] if name == "pairs_moveit" else []))
            for name in BASELINES}
    return {"sets": sets, "arms": two_arms(runs, data), "cameras": four_cameras(runs, data / "sim_metric"),
            "protocol": protocol(study, out)}


def tables(results, table):
    return {"handeye_methods": methods_table(results["sets"], table), "handeye_sets": sets_table(results["sets"], table),
            "handeye_arms": arms_table(results["arms"], table), "handeye_cameras": cameras_table(results["cameras"], table),
            "handeye_protocol": protocol_table(results["protocol"], table),
            "handeye_models": models_table(results["protocol"], table)}


def two_arms(runs, data):
    """Two sessions of one arm on one camera, taken for two arms: the second base lies in the first."""
    poses = [pose for name in ARMS for pose in read_tum(data / name / "poses.tum")]
    workspace = [sum(pose[k] for pose in poses) / len(poses) for k in range(3)]
    files = [runs.out / f"{name}.json" for name in ARMS]
    at = ["--workspace=" + ",".join(f"{x:.4f}" for x in workspace)]
    return {"workspace": workspace,
            "each by itself": runs.run("arms_composed", "register", *files, *at, "--without-images"),
            "jointly": runs.run("arms_joint", "register", *files, *at)}


def four_cameras(runs, data):
    truth = {camera: read_matrix(data / camera / "truth_T_base_camera.csv") for camera in CAMERAS}
    alone = {camera: runs.run(camera, "handeye", data / camera) for camera in CAMERAS}
    jointly = runs.run("cameras_joint", "register", "--cameras", *(data / camera for camera in CAMERAS))
    return {"truth": truth, "alone": alone, "jointly": jointly}


def protocol(study, out):
    if study is None:
        return None
    text = subprocess.run([study, str(TRIALS), str(FIRST_SEED), str(BLOCKS)], capture_output=True, text=True, check=True).stdout
    (out / "protocol.txt").write_text(text)
    return {"noise": read_protocol(text), "models": read_models(text)}


def read_protocol(text):
    pattern = (r"(eih|eth) +([\d.]+) deg +([\d.]+) mm \| park ([\d.]+)/([\d.]+) \| bundle ([\d.]+)/([\d.]+) "
               r"\| eiv ([\d.]+)/([\d.]+) \| nees ([\d.]+) \| sigma ([\d.]+) px ([\d.]+) deg ([\d.]+) mm")
    return [(match[1], *map(float, match.groups()[1:])) for match in re.finditer(pattern, text)]


def read_models(text):
    pattern = (r"arms (eih|eth) ([\d.]+) deg ([\d.]+) mm ([\d.]+) deg \| reach ([\d.]+) \| off ([\d.]+)/([\d.]+) \| found (\d+) "
               r"\| noise ([\d.]+) (\d+) \| smooth ([\d.]+) (\d+) of (\d+)")
    return [match.groups() for match in re.finditer(pattern, text)]


def methods_table(sets, table):
    rows = []
    for name, result in sets.items():
        relative, reprojection = BASELINES[name]
        pixels = dict(zip(("park", "bundle"), reprojection or ()))
        if "error" in result:
            rows.append([name, result["error"], *["-"] * 7])
            continue
        for key, method in result["comparison"].items():
            deg, mm = relative.get(key, (None, None))
            rows.append([name, METHODS.get(key, key) + (" (wild)" if method["wild"] else ""),
                         f"{method['relative_deg']:.2f} / {method['relative_mm']:.1f}", f"{shown(deg)} / {shown(mm)}",
                         shown(pixels_of(result, method, "reprojection_rms_px")), shown(pixels.get(key)),
                         shown(pixels_of(result, method, "heldout_px")), shown(method.get("heldout_mm")),
                         shown(method.get("heldout_deg"), 3)])
    return table(["set", "method", "AX = XB deg / mm", "baseline", "px", "baseline px", "held out px", "mm", "deg"], rows)


def sets_table(sets, table):
    rows = []
    for name, result in sets.items():
        if "error" in result:
            rows.append([name, result["error"], *["-"] * 8])
            continue
        sigmas, residuals, sd = result["sigmas"], result["residuals"], result["predicted_sd"]
        used = sum(view["used"] for view in result["views"])
        baseline = (BASELINES[name][1] or (None, None, None))[2]
        rows.append([name, f"{used} of {len(result['views'])}", shown(pixels_of(result, sigmas, "corner_px")),
                     f"{math.degrees(sigmas['robot_rotation_rad']):.3f} / {1000 * sigmas['robot_translation_m']:.2f}",
                     " ".join(f"{x:.2f}" for x in sd["translation_mm"]), " ".join(f"{x:.3f}" for x in sd["rotation_deg"]),
                     f"{shown(pixels_of(result, residuals, 'corner_rms_px'))} ({shown(baseline)})", size(result), verdict(result),
                     f"{result['seconds']:.1f}"])
    return table(["set", "views", "corner px", "robot deg / mm", "sd x y z mm", "sd about x y z deg",
                  "corrected px (baseline)", "target over stated size, +- 2 sd", "held out against the best other method", "CPU s"], rows)


def size(result):
    scale = result["scale"]
    return "-" if not scale else (f"{scale['estimate']:.4f} +- {2 * scale['sd']:.4f}" +
                                  (f" (wanted {scale['wanted']:.4f} +- {2 * scale['wanted_sd']:.4f})" if scale["wanted"] else ""))


def verdict(result):
    """Held-out mm and px of the answer over the least of the other methods."""
    *others, answer = [method for method in result["comparison"].values() if "heldout_mm" in method]
    ratios = {unit: round(answer[key] / min(method[key] for method in others), 3)
              for unit, key in (("px", "heldout_px"), ("mm", "heldout_mm")) if has_pixels(result) or unit == "mm"}
    worse = all(ratio > 1 for ratio in ratios.values())
    return ", ".join(f"{unit} x {ratio:.3f}" for unit, ratio in ratios.items()) + (": worse" if worse else "")


def arms_table(arms, table):
    rows = []
    for how in ("each by itself", "jointly"):
        result = arms[how]
        if "error" in result:
            rows.append([how, result["error"], *["-"] * 5])
            continue
        base = result["bases"][-1]
        R, t, p = rotation(base["rotation_xyzw"]), base["translation"], arms["workspace"]
        error = [times(R, p)[k] + t[k] - p[k] for k in range(3)]
        point = [[*row, *turned] for row, turned in zip(R, product(R, negated(skew(p))))]
        covariance = product(product(point, base["covariance"]), transposed(point))
        xi = [-x for x in times(transposed(R), t)] + logarithm(transposed(R))
        at_point, pose = distance(error, covariance), distance(xi, base["covariance"])
        rows.append([how, f"{1000 * norm(error):.1f}", f"{math.degrees(norm(logarithm(R))):.2f}",
                     " ".join(f"{1000 * math.sqrt(covariance[k][k]):.1f}" for k in range(3)),
                     f"{at_point:.1f} of {CHI_SQUARE_95[3]}", f"{pose:.1f} of {CHI_SQUARE_95[6]}",
                     "yes" if at_point < CHI_SQUARE_95[3] and pose < CHI_SQUARE_95[6] else "no"])
    return table(["solved", "off identity mm", "deg", "predicted sd x y z mm", "squared distance, point",
                  "squared distance, pose", "inside of 95 %"], rows)


def cameras_table(cameras, table):
    rows = []
    jointly = {frame["child"]: frame for frame in cameras["jointly"].get("cameras", [])}
    for camera, truth in cameras["truth"].items():
        alone = cameras["alone"][camera]
        row = [camera]
        for frame in (alone.get("transform"), jointly.get(camera)):
            row += ["-", "-"] if frame is None else [f"{x:.{digits}f}" for x, digits in zip(off(frame, truth), (2, 3))]
        used = f"{sum(view['used'] for view in alone['views'])} of {len(alone['views'])}" if "views" in alone else "-"
        covariance = jointly[camera]["covariance"] if camera in jointly else None
        predicted = " ".join(f"{1000 * math.sqrt(covariance[k][k]):.2f}" for k in range(3)) if covariance else "-"
        rows.append([*row, predicted, used, alone.get("error") or cameras["jointly"].get("error") or "-"])
    return table(["camera", "alone mm", "deg", "jointly mm", "deg", "predicted sd x y z mm", "views", "error"], rows)


def protocol_table(rows, table):
    if rows is None:
        return "Not run: no program hand_eye_study.\n"
    low, high = mean_band(6, TRIALS)
    shown_rows = []
    inside = [0] * BLOCKS
    for (setup, deg, mm), blocks in itertools.groupby(rows["noise"], key=lambda row: row[:3]):
        blocks = [row[3:] for row in blocks]
        baseline = PROTOCOL[setup, deg]
        ratios = [max(block[4 + k] / baseline[2][k] for k in range(2)) for block in blocks]
        held = [low <= block[6] <= high for block in blocks]
        inside = [count + hit for count, hit in zip(inside, held)]
        mean = [sum(column) / len(blocks) for column in zip(*blocks)]
        noise = "exact" if deg == 0 else f"{deg:g} deg, {mm:g} mm"
        pair = "{0[0]:.3f} / {0[1]:.3f}".format
        shown_rows.append(["eye-in-hand" if setup == "eih" else "eye-to-hand", noise, pair(mean[0:2]), pair(mean[2:4]),
                           pair(mean[4:6]), pair(baseline[2]), f"{min(ratios):.2f} to {max(ratios):.2f}", f"{mean[6]:.2f}",
                           f"{sum(held)} of {len(blocks)}", f"{mean[7]:.3f} / {mean[8]:.4f} / {mean[9]:.3f}"])
    return table(["setup", "robot noise", "Park deg / mm", "bundle", "errors in variables", "baseline", "ratio",
                  "NEES", f"in {low:.2f} to {high:.2f}", "estimated px / deg / mm"],
                 shown_rows) + f"\nThe number of the six rows in the band is, block by block: {' '.join(map(str, inside))}.\n"


def models_table(rows, table):
    if rows is None:
        return "Not run: no program hand_eye_study.\n"
    return table(["setup", "joint zeros, links, gears", "off deg / mm", "found", "squared distance by noise alone", "inside", "with smooth errors",
                  "inside"],
                 [["eye-in-hand" if setup == "eih" else "eye-to-hand", f"{float(zero):g} deg, {float(length):g} mm, {float(gear):g} deg",
                   f"{deg} / {mm}", f"{found} of {trials}", noise, f"{by_noise} of {trials}", smooth, f"{covered} of {trials}"]
                  for setup, zero, length, gear, reach, deg, mm, found, noise, by_noise, smooth, covered, trials in rows["models"]])


# 95 % of chi-square with 3 and 6 degrees of freedom.
CHI_SQUARE_95 = {3: 7.81, 6: 12.59}


def mean_band(freedom, trials):
    """95 % band of the mean of chi-squares (Wilson and Hilferty 1931)."""
    n = freedom * trials
    return tuple(n * (1 - 2 / (9 * n) + z * math.sqrt(2 / (9 * n))) ** 3 / trials for z in (-1.96, 1.96))


def has_pixels(result):
    return result["sigmas"]["corner_px"] is not None


def pixels_of(result, source, key):
    return source.get(key) if has_pixels(result) else None


def shown(value, digits=2):
    return "-" if value is None else f"{value:.{digits}f}" if isinstance(value, float) and value < 100 else f"{value:.0f}"


def read_tum(path):
    return [list(map(float, line.split()))[1:] for line in path.read_text().splitlines()
            if line.strip() and not line.startswith("#")]


def read_matrix(path):
    return [list(map(float, line.replace(",", " ").split())) for line in path.read_text().splitlines()[:3]]


def off(frame, truth):
    """Of a frame from its true 3 x 4 pose: mm, deg."""
    between = product(transposed(rotation(frame["rotation_xyzw"])), [row[:3] for row in truth])
    return (1000 * norm([a - row[3] for a, row in zip(frame["translation"], truth)]),
            math.degrees(norm(logarithm(between))))


def product(A, B):
    return [[sum(a * b for a, b in zip(row, column)) for column in zip(*B)] for row in A]


def transposed(A):
    return [list(column) for column in zip(*A)]


def negated(A):
    return [[-x for x in row] for row in A]


def times(A, v):
    return [sum(a * x for a, x in zip(row, v)) for row in A]


def norm(v):
    return math.sqrt(sum(x * x for x in v))


def skew(v):
    x, y, z = v
    return [[0, -z, y], [z, 0, -x], [-y, x, 0]]


def rotation(q):
    x, y, z, w = q
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]


def logarithm(R):
    """Rotation vector, of angles well below half a turn."""
    axis = [R[2][1] - R[1][2], R[0][2] - R[2][0], R[1][0] - R[0][1]]
    sine = norm(axis) / 2
    angle = math.atan2(sine, (R[0][0] + R[1][1] + R[2][2] - 1) / 2)
    return [0.5 * x if sine < 1e-9 else angle * x / (2 * sine) for x in axis]


def distance(v, covariance):
    """v^T covariance^-1 v, by Cholesky's factor."""
    L, y = [[0.0] * len(v) for _ in v], []
    for i, row in enumerate(covariance):
        for j in range(i + 1):
            rest = row[j] - sum(L[i][k] * L[j][k] for k in range(j))
            L[i][j] = math.sqrt(rest) if i == j else rest / L[j][j]
        y.append((v[i] - sum(L[i][k] * y[k] for k in range(i))) / L[i][i])
    return sum(x * x for x in y)
