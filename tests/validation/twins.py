"""Recordings of an independent simulator, whose material is known."""
import json
import math

ASSET = {"schema": "flash-asset/1", "mesh": "sheet:0.4x0.4:0.01", "element_type": "TRIANGLE",
         "mechanical_props": {"areal_density": 0.2, "thickness": 0.001, "young": 3e4, "poisson": 0.4,
                              "constitutive": "TRI_COROTATED", "bending_rigidity": 1e-4, "friction": 0.3}}
# recording: nominal D [N m], noise [m]
TWINS = {"lift_a": (1e-4, 0.002), "lift_a_one_camera_3mm": (1e-4, 0.003), "lift_b": (1e-5, 0.002)}
FACTORS = {"isometric": (0.7, 0.85, 1.0, 1.15, 1.3), "plate": (0.85, 1.0, 1.2, 1.45, 1.75)}  # of the nominal D
AS_MADE = ("--grasp-cell", "0")  # the cells of the truth, at the grasp too
PATTERNS = ("alternating", "alternating, other parity", "alternating by row")


FITS = (("lift_a", "isometric", "alternating, other parity"), ("lift_a", "isometric", "alternating"),
        ("lift_a", "isometric", "alternating by row"), ("lift_a", "plate", "alternating"),
        ("lift_a_one_camera_3mm", "isometric", "alternating, other parity"),
        ("lift_a_one_camera_3mm", "plate", "alternating"),
        ("lift_b", "isometric", "alternating, other parity"), ("lift_b", "plate", "alternating"))


def trimmed_noise(sigma):
    """Mean of |n|, n normal, without the largest 5 %: 2 (phi(0) - phi(1.96)) / 0.95 sigma."""
    return 0.7168 * sigma


def write_inputs(out):
    assets = {}
    for model in ("plate", "isometric"):
        asset = json.loads(json.dumps(ASSET))
        asset["mechanical_props"]["bending_model"] = model
        path = out / f"twin_{model}.json"
        path.write_text(json.dumps(asset, indent=2) + "\n")
        assets[model] = str(path)
    meshes = {"alternating": "sheet:0.4x0.4:0.01:alternating",
              "alternating by row": "sheet:0.4x0.4:0.01:alternating_by_row",
              "alternating, other parity": str(out / "other_parity.obj")}
    write_other_parity(out / "other_parity.obj")
    return assets, meshes


def write_other_parity(path, size=0.4, cells=40):
    """The alternating pattern with every diagonal turned: the first cell's runs across the corner."""
    lines = [f"v {size * i / cells:.9g} {size * j / cells:.9g} 0" for j in range(cells + 1) for i in range(cells + 1)]
    for j in range(cells):
        for i in range(cells):
            a = j * (cells + 1) + i + 1
            b, c, d = a + 1, a + cells + 1, a + cells + 2
            faces = [(a, b, c), (b, d, c)] if (i + j) % 2 == 0 else [(a, b, d), (a, d, c)]
            lines += ["f " + " ".join(map(str, face)) for face in faces]
    path.write_text("\n".join(lines) + "\n")


def fit(runs, data, assets, meshes, twin, model, pattern):
    """D alone on a mesh as fine as the truth's; everything else is exact by the recording's account."""
    nominal, _ = TWINS[twin]
    values = ",".join(f"{factor * nominal:.4g}" for factor in FACTORS[model])
    name = f"twin_{twin}/{model}_{pattern.replace(',', '').replace(' ', '_')}"
    return runs.grid(name, [data / "twin" / twin], "--asset", assets[model], "--mesh", meshes[pattern], "--bending",
                     values, *AS_MADE, "--no-solver-check", "--hold", "friction=0.3:measured", "--hold", "areal_density=0.2:measured")


def fit_both(runs, data, assets, meshes, twin):
    """E and D at once on the truth's diagonals. The recordings of lift_a show the same motion, simulated once."""
    return runs.grid(f"twin_{twin}/both", [data / "twin" / twin], "--asset", assets["isometric"], "--mesh",
                     meshes["alternating, other parity"], "--young", "1e4:9e4:5:log", "--bending", "5e-5:2e-4:5:log",
                     *AS_MADE, "--no-solver-check", "--hold", "friction=0.3:measured", "--hold", "areal_density=0.2:measured", "--rollouts",
                     str(runs.out / "twin_lift_a" / "rollouts"))


# Longer than the recordings: what folds after their end.
LONGER = ("--displacement=-0.1,0,0.35", "--duration", "3", "--rate", "20", "--camera", "0.2,-0.7,0.75", "--camera",
          "0.95,0.9,0.6", "--noise", "0.002", "--seed", "5")
LONGER_FITS = (("plate", "alternating"), ("isometric", "alternating"), ("isometric", "alternating by row"),
               ("isometric", "alternating, other parity"))


def horizon(runs, assets, meshes, model, pattern):
    """When the lift of lift_b, made here and gone on with to 3 s, stops being predictable [s]; None: it does not."""
    name = f"twin_longer/{model}_{pattern.replace(',', '').replace(' ', '_')}"
    mesh = ("--asset", assets[model], "--mesh", meshes[pattern], *AS_MADE)
    recording = runs.synth(f"{name}_recording", *mesh[1:], *LONGER, "--hold", "bending=1e-5:measured")
    summary = runs.grid(name, [recording], *mesh, "--bending", "8e-6,1e-5,1.25e-5", "--no-solver-check", "--hold",
                        "friction=0.3:measured", "--hold", "areal_density=0.2:measured", horizon=True)
    return summary["recordings"][0]["horizon_s"]


def pattern_stiffness(pattern, angle, cells=40):
    """Bending energy of a cylinder z = (x cos angle + y sin angle)^2 / 2 on the unit square under the sum over
    edges |e|^2 |jump of slope|^2 / (A_0 + A_1) / 2, over the plate's 1/2."""
    across, up = math.cos(angle), math.sin(angle)
    position = [(i / cells, j / cells) for j in range(cells + 1) for i in range(cells + 1)]
    height = [0.5 * (across * x + up * y) ** 2 for x, y in position]
    beside = {}
    for j in range(cells):
        for i in range(cells):
            a = j * (cells + 1) + i
            b, c, d = a + 1, a + cells + 1, a + cells + 2
            turned = {"alternating": (i + j) % 2, "alternating, other parity": (i + j + 1) % 2,
                      "alternating by row": j % 2}[pattern]
            for face in ([(a, b, c), (b, d, c)] if turned else [(a, b, d), (a, d, c)]):
                for k in range(3):
                    beside.setdefault(tuple(sorted((face[k], face[k - 1]))), []).append(face)
    energy = 0.0
    for (i, j), faces in beside.items():
        if len(faces) < 2:
            continue
        (g0, area0), (g1, area1) = (slope(face, position, height) for face in faces)
        length2 = math.dist(position[i], position[j]) ** 2
        energy += 0.5 * length2 * math.dist(g0, g1) ** 2 / (area0 + area1)
    return energy / 0.5


def slope(face, position, height):
    (x0, y0), (x1, y1), (x2, y2) = (position[i] for i in face)
    z1, z2 = height[face[1]] - height[face[0]], height[face[2]] - height[face[0]]
    scale = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
    gradient = (z1 * (y2 - y0) - z2 * (y1 - y0)) / scale, ((x1 - x0) * z2 - (x2 - x0) * z1) / scale
    return gradient, abs(scale) / 2
