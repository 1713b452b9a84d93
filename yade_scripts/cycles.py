"""Load cycles from a saved bed, start.restart; every window of cycles is a fresh process.

By hand, after prepare.py or a window before it, in a folder with params.json and the scripts:

    cp end.restart start.restart && yade -n -x -j1 cycles.py params.json

``window.start`` of params.json says how it starts: ``first`` (the piston finds the bed),
``continue`` (as saved), ``moved`` (grains put at ``window.moved``), ``perturbed``.
Leaves states.dump and contacts.dump (one frame a cycle end), piston.txt, end.restart.
"""

import os
import sys
import time

from yade import Omega, Vector3

sys.path.insert(0, os.getcwd())
import bed
import record

O = Omega()
parameters = bed.read_parameters()
gravity, window = parameters["gravity"], parameters["window"]
record.load_scene()
piston = bed.Piston(parameters)


def seat():
    """Press the piston on the bed, then let it go, before the first cycle.

    Let loose on the highest grain it would fall through the gap to the next ones and throw up
    half the bed.  A viscous drag holds it at ``speed`` or less.
    """
    press = window["seat"]
    bed.set_engines(parameters, [bed.make_drag_engine(piston, press["force"] / press["speed"])])
    piston.press(press["force"], gravity)
    O.run(press["steps"], True)
    piston.press(press["release_force"], gravity)
    O.run(press["release_steps"], True)
    piston.grains_share()


def move_grains(positions):
    """Put the grains at rest at new positions [m]; contacts keep their tangential springs."""
    for number, position in enumerate(positions):
        state = O.bodies[number].state
        state.pos, state.vel, state.angVel = Vector3(*position), Vector3.Zero, Vector3.Zero


def renew_friction():
    """Give contacts that the rain made, with less friction, that of the load cycles."""
    for contact in O.interactions:
        if contact.isReal:
            pair = {O.bodies[number].material.label for number in (contact.id1, contact.id2)}
            found = [p for p in parameters["pairs"] if {p["first"], p["second"]} == pair]
            contact.phys.tangensOfFrictionAngle = found[0]["friction"]


def press_surface(forces):
    """Constant forces down on the grains [N]: weight of the ballast beside a block.

    YADE does not save them: they are set again after each load.
    """
    for number, force in enumerate(forces):
        O.forces.setPermF(number, Vector3(0, 0, -force))


press_surface(window.get("crib", []))
if window.get("renew_friction"):
    renew_friction()
loop_s = time.process_time()
if window["start"] == "first":
    seat()
elif window["start"] == "moved":
    move_grains(window["moved"])
    piston.grains_share()
    piston.place(parameters["piston"]["height"])
elif window["start"] == "perturbed":
    O.bodies[0].state.pos += Vector3(window["perturbation"], 0, 0)

load = bed.make_load_engine(window["load"], piston)
piston_record = record.PistonRecord(piston, gravity, window["track_steps"])


def set_engines():
    """Those of a load cycle."""
    bed.set_engines(parameters, [load], [piston_record.watch], [piston_record.watch_behind])


set_engines()
piston.press(window["load"]["mean_force"], gravity)
dumps = record.Dumps(parameters, piston)
bed.renew_forces([load])
dumps.frame()
for _ in range(window["cycles"]):
    O.run(window["steps_per_cycle"], True)
    if piston.grains_share():
        set_engines()
    bed.renew_forces([load])
    dumps.frame()
piston_record.last(record.tabulate_grains(dumps.count))
loop_s = time.process_time() - loop_s
record.save_scene()
print(f"LOOP {loop_s:.6f} s\nCOMPLETE step {O.iter}", flush=True)
