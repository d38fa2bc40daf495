"""A reference scene as the files that flash-sim reads: an asset and a scene of schema flash-scene/1."""
import csv
import itertools
import json

CONSTITUTIVE = {"arap": "TRI_ARAP", "corot": "TRI_COROTATED", "stvk": "TRI_STVK", "nh": "TRI_NEOHOOKEAN"}
SOLID_CONSTITUTIVE = {"corot": "TET_COROTATED", "snh": "TET_NEOHOOKEAN_LOG", "snh2": "TET_NEOHOOKEAN"}
BENDING = {"quadratic": "isometric", "hinge": "hinge"}
NO_MEMBRANE = 1e-20  # E t of a scene of bending alone: its forces are below the last digit of bending's [N/m]
LIFT_SECONDS = 2.5   # lifts are judged up to here


def read_points(path):
    with open(path, newline="") as file:
        return [tuple(map(float, row)) for row in csv.reader(file)]


def is_solid(scene):
    return scene["mesh"].endswith(".tet")


def solid_asset_of(scene, mesh):
    material = scene["material"]
    return {"schema": "flash-asset/1", "mesh": str(mesh), "element_type": "TETRAHEDRON",
            "mechanical_props": {"constitutive": SOLID_CONSTITUTIVE[material["model"]], "young": material["E"],
                                 "poisson": material["nu"], "density": material.get("density", 100.0)}}


def asset_of(scene, mesh):
    if is_solid(scene):
        return solid_asset_of(scene, mesh)
    material, bending = scene.get("material"), scene.get("bending")
    properties = {"constitutive": "TRI_COROTATED", "young": NO_MEMBRANE, "poisson": 0.3, "areal_density": 0.2,
                  "bending_rigidity": bending["D"] if bending else 0, "friction": 0.3}
    if material:
        properties |= {"constitutive": CONSTITUTIVE[material["model"]], "poisson": material["nu"],
                       "young": material["E"], "thickness": material["thickness"],
                       "areal_density": material.get("areal_density", 0.2)}
    return {"schema": "flash-asset/1", "mesh": str(mesh), "element_type": "TRIANGLE", "mechanical_props": properties}


def scene_of(scene, rest, folder, scenes):
    """The scene; forces are written under the names "gripper", "right", "top", "vertex 12", ..."""
    cloth = {"asset": "asset.json", "velocity": scene.get("v0", [0, 0, 0])}
    bending = scene.get("bending", {"model": "quadratic"})["model"]
    result = {"schema": "flash-scene/1", "name": scene["name"], "gravity": scene.get("gravity", [0, 0, 0]),
              "bending_model": BENDING[bending], "solver": {"iterations": 400, "tolerance": 1e-6},
              "objects": {"cloth": cloth}}
    if isinstance(scene.get("plane"), dict):
        result["obstacles"] = {"plane": {"shape": "plane", "point": [0, 0, scene["plane"]["z"]], "normal": [0, 0, 1],
                                         "friction": scene["plane"]["friction"]}}
    at_rest = {"static": at_equilibrium, "unit": at_given_positions, "equilibrium": from_equilibrium}
    at_rest.get(scene["kind"], in_motion)(scene, rest, folder, scenes, result, cloth)
    return result


def fixed_one_by_one(scene, over=0):
    """A support a vertex, so that each has its force."""
    return [{"name": f"vertex {vertex}", "vertices": [vertex], "positions": [position], "over": over}
            for vertex, position in zip(scene["fixed"]["vertices"], scene["fixed"]["positions"])]


def at_equilibrium(scene, rest, folder, scenes, result, cloth):
    """Long steps without velocity; supports move to their places over ten of them."""
    cantilever = scene["name"].startswith("cantilever")
    # A cantilever's own time: it swings down without folding on the way.
    result |= {"timestep": 0.05 if cantilever else 1.0, "steps": 110, "keyframes": [],
               "quasistatic": {"motion": 1e-9}}
    # Rounding leaves 2e-9 of the weight out of balance on the finer meshes of the solid cantilever.
    result["solver"]["tolerance"] = 1e-7 if cantilever or is_solid(scene) and "fixed" in scene else 1e-9
    over = 10 * result["timestep"]
    if "fixed" in scene:
        cloth["fixed"] = fixed_one_by_one(scene, over)
    elif is_solid(scene):
        cloth["fixed"] = rollers_of_bar(scene, rest, over)
    if "rollers" not in scene:
        return
    right = max(x for x, _, _ in rest)
    sides = {side: [v for v in scene["rollers"]["x"]["vertices"] if (rest[v][0] == right) == (side == "right")]
             for side in ("left", "right")}
    cloth["fixed"] = [{"name": side, "vertices": vertices, "axes": "x", "over": over,
                       "positions": [[scene["stretch"] * rest[v][0], rest[v][1], rest[v][2]] for v in vertices]}
                      for side, vertices in sides.items()]
    cloth["fixed"] += [{"name": "corner", "vertices": scene["rollers"]["y"]["vertices"], "axes": "y"},
                       {"name": "floor", "vertices": "all", "axes": "z"}]


def rollers_of_bar(scene, rest, over):
    """Both ends held along x, the faces y = 0 and z = 0 across."""
    right = max(x for x, _, _ in rest)

    def face(axis, value):
        return [v for v, p in enumerate(rest) if p["xyz".index(axis)] == value]

    return [{"name": "right", "vertices": face("x", right), "axes": "x", "over": over,
             "positions": [[scene["stretch"] * right, *rest[v][1:]] for v in face("x", right)]}] + [
            {"name": name, "vertices": face(axis, 0), "axes": axis}
            for name, axis in (("left", "x"), ("side", "y"), ("floor", "z"))]


def at_given_positions(scene, rest, folder, scenes, result, cloth):
    """Every vertex held where it is given: the supports carry the elastic forces."""
    write_mesh(folder / "start.obj", scene["x"], [])
    cloth |= {"start": "start.obj", "fixed": [{"name": f"vertex {v}", "vertices": [v]} for v in range(len(rest))]}
    result |= {"timestep": 0.01, "steps": 1}


def from_equilibrium(scene, rest, folder, scenes, result, cloth):
    write_mesh(folder / "start.obj", read_points(scenes / scene["reference_positions"]), [])
    vertices, half = scene["fixed"]["vertices"], len(scene["fixed"]["vertices"]) // 2
    cloth |= {"start": "start.obj",
              "fixed": [{"name": name, "vertices": vertices[part], "positions": scene["fixed"]["positions"][part]}
                        for name, part in (("hand", slice(half)), ("gripper", slice(half, None)))]}
    result |= {"timestep": 0.01, "duration": 1.0}


def in_motion(scene, rest, folder, scenes, result, cloth):
    result |= {"timestep": scene["dt"], "steps": scene["steps"]}
    if "frames" not in scene:
        return
    result["solver"]["tolerance"] = 1e-5
    if is_solid(scene):
        result["keyframes"] = sorted(map(float, scene["frames"]))
        return
    result |= {"steps": round(LIFT_SECONDS / scene["dt"]),
               "keyframes": sorted(float(t) for t in scene["frames"] if float(t) <= LIFT_SECONDS)}
    keyframes = []
    for step in range(scene["steps"] + 1):
        tau = step / scene["steps"]
        s = tau ** 3 * (10 - 15 * tau + 6 * tau ** 2)
        keyframes.append({"t": step * scene["dt"], "translation": [-0.1 * s, 0, 0.35 * s]})
    cloth["prescribed"] = [{"name": "gripper", "vertices": scene["fixed"]["vertices"], "keyframes": keyframes}]


def write_mesh(path, vertices, faces):
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices]
    path.write_text("\n".join(lines + ["f %d %d %d" % tuple(v + 1 for v in face) for face in faces]) + "\n")


def refined_cantilever(scene, times, folder):
    """The scene of the solid cantilever with cells `times` as small, its mesh written to `folder`. A cell is cut into six
    tetrahedra along its diagonal (Kuhn)."""
    cells = (10 * times, 2 * times, 2 * times)
    size = (0.5, 0.1, 0.1)
    nodes = list(itertools.product(*(range(n + 1) for n in cells)))
    number = {node: v for v, node in enumerate(nodes)}
    rest = [tuple(length * i / n for i, n, length in zip(node, cells, size)) for node in nodes]
    elements = []
    for cell in itertools.product(*map(range, cells)):
        for order in itertools.permutations(range(3)):
            corner, path = list(cell), [number[cell]]
            for axis in order:
                corner[axis] += 1
                path.append(number[tuple(corner)])
            elements.append(path)
    folder.mkdir(parents=True, exist_ok=True)
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in rest]
    lines += ["t " + " ".join(str(v + 1) for v in element) for element in elements]
    (folder / "mesh.tet").write_text("\n".join(lines) + "\n")
    clamped = [v for v, p in enumerate(rest) if p[0] == 0]
    return scene | {"mesh": str((folder / "mesh.tet").resolve()),
                    "fixed": {"vertices": clamped, "positions": [rest[v] for v in clamped]}}, rest


def write(scene, rest, folder, scenes):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "asset.json").write_text(json.dumps(asset_of(scene, (scenes / scene["mesh"]).resolve()), indent=1))
    (folder / "scene.json").write_text(json.dumps(scene_of(scene, rest, folder, scenes), indent=1))
    return folder / "scene.json"
