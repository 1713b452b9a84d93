"""Rain of grains under gravity until equilibrium (Karrech et al. 2007, section 2.3).

By hand, in a folder with params.json and the scripts of this one:

    yade -n -x -j1 prepare.py params.json

``trackbed run SCENE --engine yade --dry-run`` writes the params.json of a scene; SI units.
Leaves history.txt, rain.dump, states.dump and contacts.dump (the settled bed), end.restart.
"""

import os
import sys
import time

import numpy as np
from yade import Omega
from yade.wrapper import PyRunner

sys.path.insert(0, os.getcwd())
import bed
import record

O = Omega()
HISTORY = (
    "step time_s kinetic_translational_J kinetic_rotational_J potential_J "
    "coordination_number floor_force_N\n"
)

parameters = bed.read_parameters()
settle = parameters["settle"]
count = parameters["grain_count"]
bed.add_materials(parameters)
bed.add_grains(parameters)
bed.add_walls(parameters)
floor = count + [wall["name"] for wall in parameters["walls"]].index("floor")

history = open("history.txt", "w", encoding="ascii")
history.write(HISTORY)
rain = open("rain.dump", "w", encoding="ascii")


def find_potential_energy(grains):
    """Weight times height of all grains [J]."""
    return parameters["gravity"] * grains[:, 10] @ grains[:, 2]


def add_history():
    """One line of ``history.txt`` and one frame of ``rain.dump``; called by an engine."""
    grains = record.tabulate_grains(count)
    pairs = sum(i.isReal and max(i.id1, i.id2) < count for i in O.interactions)
    energies = (*record.sum_kinetic_energies(grains), find_potential_energy(grains))
    push = -O.forces.f(floor, True)[2]
    row = (O.iter, O.time, *energies, 2 * pairs / count, push)
    history.write(" ".join(f"{value:.9g}" for value in row) + "\n")
    history.flush()
    values = np.column_stack([np.arange(1, count + 1), grains[:, [0, 1, 2, 9]]])
    record.write_frame(rain, "ATOMS", "id x y z radius", values, 1, parameters["box"], "%.9g")


watch = PyRunner(command="add_history()", iterPeriod=settle["history_steps"])
bed.set_engines(parameters, watch=[watch])

loop_s = time.process_time()
for _ in range(settle["check_limit"]):
    O.run(settle["check_steps"], True)
    # Translational energy only: a loose grain that spins about its contact normal has no
    # friction torque to stop it and keeps its rotational energy for ever.
    grains = record.tabulate_grains(count)
    ratio = record.sum_kinetic_energies(grains)[0] / find_potential_energy(grains)
    if ratio <= settle["equilibrium_ratio"] and O.iter >= settle["minimum_steps"]:
        break
    if not np.isfinite(ratio):
        sys.exit(f"ERROR: the energy of the grains is {ratio} at step {O.iter}")
else:
    print(f"NOT SETTLED ratio {ratio}", flush=True)
    sys.exit(0)
loop_s = time.process_time() - loop_s

bed.renew_forces()
record.Dumps(parameters).frame()
record.save_scene()
print(f"LOOP {loop_s:.6f} s\nCOMPLETE step {O.iter}", flush=True)
