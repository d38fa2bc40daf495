#!/usr/bin/env python3
"""Runs flash-calib on recorded hand-eye sets, flash-sysid on recorded lifts and on recordings of an independent
simulator, and writes what came out into docs/validation/. Finished runs are kept: called again, it goes on where it was."""
import argparse
import concurrent.futures
import pathlib
import shutil

import beam
import beam_search
import handeye
import convergence
import lifts
import limits
import reference
import synthetic
import tables
import twins
from runs import Runs


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sysid", required=True, help="the program flash-sysid")
    parser.add_argument("--calib", help="the program flash-calib")
    parser.add_argument("--hand-eye-study", help="the program hand_eye_study")
    parser.add_argument("--data", required=True, type=pathlib.Path, help="folder with handeye/, lift/, twin/ and beam/")
    parser.add_argument("--out", required=True, type=pathlib.Path, help="folder of the runs")
    parser.add_argument("--documents", required=True, type=pathlib.Path, help="folder of the chapters, where the tables go")
    parser.add_argument("--sim", help="the program flash-sim")
    parser.add_argument("--scenes", type=pathlib.Path, help="folder of the reference scenes")
    parser.add_argument("--results", type=pathlib.Path, help="what make reference wrote of them")
    parser.add_argument("--only", help="handeye, lifts, fold_models, twins, synthetic, convergence, beam or reference: "
                                       "that part of the document; a recording: its fits alone, printed")
    parser.add_argument("--twins", type=int, default=len(synthetic.TWINS), help="how many of the coverage study")
    parser.add_argument("--jobs", type=int, default=1, help="recorded lifts searched at a time")
    parser.add_argument("--threads", type=int, help="of each search; without it, as many as there are processors")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    runs = Runs(options.sysid, options.out, options.threads)
    if options.only in lifts.CLIPS:
        fit = lifts.fit(runs, options.data, lifts.write_asset(runs.out), options.only)
        return print(tables.clip_table({options.only: fit}), end="")
    if options.only in twins.TWINS:
        return print(tables.twin_table(run_twins(runs, options.data, options.only)), end="")
    document = {}
    if options.only in (None, "reference") and options.results:
        document |= reference.tables(options.scenes, options.results, tables.table)
    if options.only in (None, "handeye") and options.calib:
        results = handeye.run(options.calib, options.data / "handeye", options.out / "handeye", options.hand_eye_study)
        document |= handeye.tables(results, tables.table)
    if options.only in (None, "convergence") and options.sim:
        document |= convergence.tables(options.sim, options.out, tables.table)
    if options.only in (None, "beam") and options.sim:
        document |= beam.tables(options.sim, options.data / "beam", options.out, tables.table)
        document |= beam_search.tables(runs, options.data / "beam", tables.table)
    if options.only in (None, "lifts"):
        results = run_lifts(runs, options.data, options.jobs)
        document |= tables.lift_tables(results)
        copy_pictures(options.out, options.documents.parent / "images")
    if options.only in (None, "fold_models"):
        document["fold_models"] = tables.fold_models_table(lifts.fold_models(runs, options.data))
    if options.only in (None, "twins"):
        document |= tables.twin_tables(run_twins(runs, options.data), run_both(runs, options.data),
                                       run_horizons(runs))
    if options.only in (None, "synthetic"):
        found = synthetic.coverage(runs, synthetic.TWINS[:options.twins])
        document |= tables.synthetic_tables(synthetic.experiment_rows(runs), synthetic.coverage_rows(found))
    tables.replace_tables(options.documents, document)
    print(options.documents)


def copy_pictures(out, images):
    images.mkdir(exist_ok=True)
    for source, name in (("lift_paper/best_replay/sequence.png", "paper.png"),
                         ("lift_navy/best_replay/sequence.png", "navy.png"),
                         ("lift_tan/best_replay/sequence.png", "tan.png"),
                         ("lift_paper/picture/020.png", "overlay.png")):
        shutil.copyfile(out / source, images / name)


def run_lifts(runs, data, jobs):
    """So many recordings at a time."""
    asset = lifts.write_asset(runs.out)
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        fits = dict(zip(lifts.CLIPS, pool.map(lambda clip: lifts.fit(runs, data, asset, clip), lifts.CLIPS)))
        material = {clip: fit["material"] for clip, fit in fits.items()}
        limited = ("lift_paper", "lift_navy", "lift_tan")
        limits_of = pool.map(lambda clip: limits.measure(runs, data, asset, clip, material[clip]), limited)
        pairs_of = pool.map(lambda pair: run_pair(runs, data, asset, pair, material), lifts.PAIRS)
        pairs = dict(zip(lifts.PAIRS, pairs_of))
        fold = lifts.fold(runs, data, asset, pairs["paper"]["joint"])
        one_bending = lifts.lifts_and_fold(runs, data, asset, material, fold)
        lifts.best_replay(runs, data, asset, "lift_paper", material["lift_paper"], "picture", "20")
        return {"fits": fits, "pairs": pairs, "fold": fold, "one_bending": one_bending, "limits": dict(zip(limited, limits_of))}


def run_pair(runs, data, asset, pair, material):
    first, second = lifts.PAIRS[pair]
    return {"there": lifts.predict(runs, data, asset, first, material[first], second),
            "back": lifts.predict(runs, data, asset, second, material[second], first),
            "joint": lifts.fit_pair(runs, data, asset, pair, material[first])}


def run_twins(runs, data, only=None):
    inputs = twins.write_inputs(runs.out)
    return {fit: twins.fit(runs, data, *inputs, *fit) for fit in twins.FITS if only in (None, fit[0])}


def run_both(runs, data):
    inputs = twins.write_inputs(runs.out)
    return {twin: twins.fit_both(runs, data, *inputs, twin) for twin in ("lift_a", "lift_a_one_camera_3mm")}


def run_horizons(runs):
    inputs = twins.write_inputs(runs.out)
    return {fit: twins.horizon(runs, *inputs, *fit) for fit in twins.LONGER_FITS}


if __name__ == "__main__":
    main()
