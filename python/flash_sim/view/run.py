"""What a search found: the motion of its answer over what was seen, and the answer in numbers."""
import pathlib
from dataclasses import dataclass

import numpy as np

from flash_sim import _core
from flash_sim.bag.errors import refusal
from flash_sim.view import page
from flash_sim.view.drawn import Points, Surface, table
from flash_sim.view.tables import read_json, read_table

SEARCH, REPLAY = "flash-sysid grid or fit", "flash-sysid replay"
UNITS = {"bending": "N m", "areal_density": "kg/m²", "density": "kg/m³", "yield_curvature": "1/m", "air_drag": "1/s",
         "stiffness_damping": "s", "start_yaw": "rad", "table_height": "m", "grasp_size": "m", "grasp_stiffness": "N/m³",
         "grasp_depth": "m", "grasp_direction": "rad", "grasp_pitch": "rad"}
FIRST_CANDIDATES = 5


@dataclass(frozen=True, eq=False)
class Motion:
    """A simulated surface at each keyframe over what was seen then, both in the frame of the observation."""

    name: str
    times: np.ndarray      # (n,) [s]
    scores: np.ndarray     # (n,) [m], of keyframes with points
    meshes: list           # (V, 3) each [m]
    triangles: np.ndarray  # (T, 3)
    clouds: list           # (k, 3) each [m]


@dataclass(frozen=True)
class Words:
    """What a folder says, in markdown."""

    answer: str
    warnings: str = ""
    candidates: str = ""


@dataclass(frozen=True)
class Run:
    """Motions to choose from, and what their folders say about them."""

    motions: list
    words: dict  # Words by the name of a motion


def load_runs(folders):
    """The Run of folders of searches and of replays. Throws RecordingError, or ValueError of a file, in one line."""
    motions, words = [], {}
    for folder in map(pathlib.Path, folders):
        if not folder.is_dir():
            raise refusal(folder, f"is no folder, expected that of {SEARCH}, or of {REPLAY}")
        prefix = f"{folder}: " if len(folders) > 1 else ""
        if (folder / "overlay.csv").is_file():
            found, text = [load_motion(folder, str(folder))], Words("A replay. Its folder does not say of which values.")
        else:
            summary = read_json(folder / "summary.json", "flash-sysid-summary/", SEARCH)
            found = [load_motion(path, prefix + path.name) for path in _answers(folder)]
            text = answer_words(summary, folder)
        motions += found
        words |= {motion.name: text for motion in found}
    return Run(motions, words)


def load_motion(folder, name):
    """The Motion that `flash-sysid replay`, or a search in best/, wrote to a folder."""
    folder = pathlib.Path(folder)
    rows = read_table(folder / "overlay.csv", ("t", "score_m", "points"))
    if not rows:
        raise refusal(folder / "overlay.csv", "found no keyframes, expected one a line")
    meshes = [_core.load_mesh(str(folder / f"{k:03d}_mesh.ply")) for k in range(len(rows))]
    clouds = [_core.load_cloud(str(folder / f"{k:03d}_cloud.ply")) for k in range(len(rows))]
    if any(len(vertices) != len(meshes[0][0]) for vertices, _ in meshes):
        raise refusal(folder, "found meshes of different numbers of vertices, expected one mesh that moves")
    return Motion(name, np.array([row["t"] for row in rows]),
                  np.array([row["score_m"] if row["points"] > 0 else np.nan for row in rows]),
                  [vertices for vertices, _ in meshes], meshes[0][1], clouds)


def _answers(folder):
    found = sorted(path.parent for path in (folder / "best").glob("*/overlay.csv"))
    if not found:
        raise refusal(folder / "best", f"found no motion of the answer, expected that of {SEARCH}; {REPLAY} makes one in a folder "
                                       "of its own")
    return found


def answer_words(summary, folder):
    """Words of the answer with its intervals, how well it fits, and the candidates that come next to it."""
    try:
        axes, best = summary["axes"], summary["best"]["parameters"]
        units = {"young": "Pa" if "thickness_m" in summary["settings"] else "N/m"} | UNITS
        rows = [(name, _number(best.get(name)), _interval(summary["parameters"][name]), units.get(name, "")) for name in axes]
        answer = table(("", "estimate", "95 %", "unit"), rows) + f"\n\n**Fit:** {1e3 * summary['best']['score']:.2f} mm on average"
        for recording in summary["recordings"]:
            offset = ", ".join(f"{1e3 * value:.1f}" for value in recording["offset"])
            answer += f"\n\n**{recording['name']}:** the camera sees it {offset} mm (x, y, z) from where it is simulated"
        if summary["exit_code"]:
            answer += "\n\n**This answer cannot be used:** the first warning says why."
        warnings = "\n\n".join(map(str, summary["warnings"]))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise refusal(folder / "summary.json", f"found no {error}, expected the fields of {SEARCH}") from None
    return Words(answer, warnings, _candidates(folder / "results.csv", axes))


def _candidates(path, axes):
    rows = [row for row in read_table(path, (*axes, "score_m"), ("id", "status")) if row["status"] == "ok"]
    rows = sorted(rows, key=lambda row: row["score_m"])[:FIRST_CANDIDATES]
    if not rows:
        return ""
    lines = table(("", *axes, "mm"), [(row["id"], *(_number(row[axis]) for axis in axes), f"{1e3 * row['score_m']:.2f}") for row in rows])
    holds = ",".join(f"{axis}={rows[0][axis]:.6g}" for axis in axes)
    return (f"{lines}\n\nThis makes the motion of one, to be named beside this folder:\n\n"
            f"`flash-sysid replay RECORDING --asset ASSET --hold {holds} -o FOLDER`")


def _interval(parameter):
    if not parameter["interval95"]:
        return "none"
    low, high = map(_number, parameter["interval95"])
    return {"yes": f"{low} to {high}", "lower_bound": f"above {low}", "upper_bound": f"below {high}"}.get(
        parameter["identifiable"], "not identifiable")


def _number(value):
    return "not known" if value is None else f"{value:.3g}"


def show(server, run):
    """Puts a run on the page; what is to be called again and again."""
    box = page.box_about([points for motion in run.motions for points in (*motion.meshes, *motion.clouds)])
    page.furnish(server, box)
    motions = {motion.name: motion for motion in run.motions}
    choice = server.gui.add_dropdown("motion", list(motions), visible=len(motions) > 1)
    timeline = page.Timeline(server, run.motions[0].times, first=len(run.motions[0].times) - 1)
    with_mesh, with_points = server.gui.add_checkbox("simulated", True), server.gui.add_checkbox("seen", True)
    fit, answer = server.gui.add_markdown(""), server.gui.add_markdown("")
    warnings, candidates = page.Folded(server, "warnings"), page.Folded(server, "best candidates of the search")
    surface, points = Surface(server, "/simulated"), Points(server, "/seen", 0.002 * box.size)
    shown = None

    def tick():
        nonlocal shown
        motion = motions[choice.value]
        if shown is None or motion is not shown[0]:
            timeline.set_times(motion.times)
            words = run.words[motion.name]
            answer.content = words.answer
            warnings.show(words.warnings)
            candidates.show(words.candidates)
        frame = timeline.frame()
        wanted = (motion, frame, with_mesh.value, with_points.value)
        if wanted == shown:
            return
        surface.show(motion.meshes[frame], motion.triangles, with_mesh.value)
        points.show(motion.clouds[frame], with_points.value)
        fit.content = f"**Distance:** {_distance(motion, frame)}"
        shown = wanted
    return tick


def _distance(motion, frame):
    if np.isnan(motion.scores[frame]):
        return "no points at this time"
    return f"{1e3 * motion.scores[frame]:.2f} mm on average from {len(motion.clouds[frame]):,} points"
