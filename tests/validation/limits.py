"""What the residual of a lift depends on beside the material, one cause at a time."""
import lifts
import surface


def measure(runs, data, asset, clip, search):
    recording = data / "lift" / clip
    options, parameters = lifts.grasp_of(search)
    material = ["--asset", asset, *lifts.SEARCH, *lifts.window(clip), "--hold", f"bending={parameters['bending']!r}:measured", "--hold",
                f"young={parameters['young']!r}:measured", "--no-solver-check"]
    yaw = ["--hold", f"start_yaw={parameters['start_yaw']!r}"]
    table = runs.grid(f"{clip}/table_and_friction", [recording], *material, *yaw, *lifts.GRASPS[search["grasp"]],
                      "--table-height=-0.015,0,0.015", "--friction", "0.2,0.6")
    pinch = runs.grid(f"{clip}/pinch_shape", [recording], *material, *yaw, "--grasp-shape", "pinch", "--grasp-depth",
                      "0.021,0.041", "--grasp-pitch=-0.5,0,0.5")
    best = lifts.best_replay(runs, data, asset, clip, search)
    return {"search": search, "best": best, "table": table, "pinch": pinch,
            "free_pose": free_pose(runs, recording, clip, asset, options, parameters),
            "zones": surface.residual_by_zone(runs.out / clip / "best_replay", (12, 16, 20, 24)),
            "piercings": surface.piercings_by_frame(runs.out / clip / "best_replay", range(10, 25))}


def free_pose(runs, recording, clip, asset, options, parameters):
    """The score if every keyframe had its own offset, yaw and clock: what is left is shape [m]. Every second."""
    scores = []
    for frame in range(10, 25, 2):
        time = f"{frame / 10:.1f}"
        replay = runs.replay(f"{clip}/free_pose/{frame:03d}", recording, parameters, "--asset", asset, "--mesh",
                             lifts.MESH, "--from", time, "--until", time, *options)
        scores.append(replay["score"])
    return sum(scores) / len(scores)
