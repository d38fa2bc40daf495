"""Recordings of deformable objects, replayed and held against what was seen, and answers of flash-sysid.

load reads a recording, replay simulates it, distances says how far a motion is from what was seen, answer reads what a search
found. Likelihood is for samplers of one's own. All numbers are float64 in SI units; frames and times are those of the recording.

    recording = flash_sim.sysid.load("lift")
    motion = flash_sim.sysid.replay(recording, {"bending": 1e-4, "friction": 0.3})
    print(flash_sim.sysid.distances(recording, motion).score)
"""
from flash_sim.sysid.answers import Answer, answer
from flash_sim.sysid.likelihood import Likelihood
from flash_sim.sysid.recordings import Recording, load
from flash_sim.sysid.replays import Distances, Motion, SolverWarning, distances, parameters, replay

__all__ = ["Answer", "Distances", "Likelihood", "Motion", "Recording", "SolverWarning", "answer", "distances", "load",
           "parameters", "replay"]
