"""A script of a user's own, cut at its two marks: the bed, then load cycles from a saved scene.

A window executes the imports and the definitions of functions and classes that stand above the
cycle, loads the scene with the values that the script's variables had, and executes the statements
between the marks once a cycle.  Carried are numbers, texts, vectors, arrays and bodies, and lists
of these; a cycle that uses something else ends with its name.
Called by the scripts that ``trackbed adopt`` and ``trackbed run`` write.
"""

import ast
import json
import os
import random
import sys
import tokenize
from contextlib import suppress
from types import FunctionType
from unittest.mock import MagicMock

import numpy as np
import yade
from yade import Omega, plot, wrapper

from .record import load_scene, split_vector, write_scene

O = Omega()
DECLARED = (ast.Import, ast.ImportFrom, ast.FunctionDef, ast.ClassDef)
"""Statements above the cycle that a window executes again."""
TAG = "trackbed"
"""Under which a saved scene holds the script's variables."""
PLOTTED = ("data", "plots", "labels")
"""Of YADE's module plot, what a scene does not hold."""
RANDOM, LOST = "random.states", "names.lost"
"""Where random numbers go on, and names of what no window can have; no variables have a dot."""
VECTORS = {name: getattr(yade, name) for name in ("Vector2", "Vector3", "Quaternion")}


def run(kind, script, marks, cycles, loaded, names):
    """Run ``cycles`` load cycles of ``script`` in ``names``, the globals of the script called.

    ``kind``: whole (behind all that makes the bed) or window (from ``cycle_0.restart``, moved as
    ``moved.npz`` says).  ``marks``: lines of the two marks.  ``loaded``: name of the variable that
    holds the loaded body, its number, or several; may be empty.
    """
    given = dict(names)  # by YADE, in each process
    sys.modules["yade.qt"] = yade.qt = MagicMock()  # no window is opened, whatever is asked of it
    first, last = marks
    with tokenize.open(script) as stream:
        statements = ast.parse(stream.read(), script).body
    before = [one for one in statements if one.lineno < first]
    cycle = build([one for one in statements if first < one.lineno < last], script)
    if kind == "window":
        values = load_values()
        held = {key: values.pop(key) for key in [*values] if "." in key}
        for name in held.pop(LOST):  # else it would be what YADE calls so
            names.pop(name, None)
        names |= values  # which defaults of functions may be
        for one in before:
            if isinstance(one, DECLARED):
                with suppress(ImportError):  # of modules that YADE made of what is carried
                    exec(build([one], script), names)
        names |= values
        restore_held(held, names)
        move_grains(list_loaded(loaded, names))
    else:
        exec(build(before, script), names)
        O.wait()
        pulls = [one.gravity for one in O.engines if isinstance(one, wrapper.NewtonIntegrator)]
        if any(pull[0] or pull[1] or pull[2] > 0 for pull in pulls):
            sys.exit("ERROR: gravity is not along -z, where settlement is: turn the script")
        write_state(0, loaded, names, given)
    for number in range(1, cycles + 1):
        exec(cycle, names)
        O.wait()
        write_state(number, loaded, names, given)
    print(f"COMPLETE step {O.iter}", flush=True)


def build(statements, script):
    """Code of statements, with their lines for what goes wrong."""
    return compile(ast.Module(statements, []), script, "exec")


def pack(value):
    """A variable's value as JSON; raises TypeError for what a window can not have."""
    value = value.item() if isinstance(value, np.generic) else value
    kind = type(value).__name__
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if kind in ("list", "tuple", "set"):
        return [kind, [pack(one) for one in value]]
    if kind == "dict":
        return [kind, [[pack(key), pack(one)] for key, one in value.items()]]
    if kind == "ndarray" and value.dtype.kind in "biuf":
        return [kind, value.tolist()]
    if kind in VECTORS:
        inner = [float(x) for x in value]
        return [kind, inner[3:] + inner[:3]]  # YADE lists a quaternion as x y z w, made of w x y z
    if kind == "Body" and value.id is not None:
        return [kind, value.id]
    raise TypeError(kind)


def unpack(value):
    """What `pack` packed."""
    if not isinstance(value, list):
        return value
    kind, inner = value
    if kind in VECTORS:
        return VECTORS[kind](*inner)
    if kind == "Body":
        return O.bodies[inner]
    if kind == "ndarray":
        return np.array(inner)
    if kind == "dict":
        return {unpack(key): unpack(one) for key, one in inner}
    return {"list": list, "tuple": tuple, "set": set}[kind](map(unpack, inner))


def load_values():
    """Load ``cycle_0.restart``; the values by name, of variables and with a dot of `list_held`."""
    load_scene("cycle_0.restart")
    values = json.loads(bytes.fromhex(O.tags[TAG]))
    O.tags[TAG] = ""
    return {name: unpack(value) for name, value in values.items()}


def list_held(names):
    """What modules, and functions and classes of ``names``, hold: (name with a dot, value)."""
    yield from ((f"plot.{key}", {**vars(plot)[key]}) for key in PLOTTED)
    yield RANDOM, [random.getstate(), np.random.get_state()]  # noqa: NPY002  the script's own
    for name, one in names.items():
        if isinstance(one, (FunctionType, type)) and one.__module__ == "__main__":
            own = [key for key in vars(one) if not key.startswith("__")]
            own += ["__defaults__"] * isinstance(one, FunctionType)
            yield from ((f"{name}.{key}", getattr(one, key)) for key in own)


def restore_held(held, names):
    """Give back what `list_held` found."""
    for key in PLOTTED:
        vars(plot)[key].update(held.pop(f"plot.{key}", {}))
    for state, restore in zip(held.pop(RANDOM), (random.setstate, np.random.set_state)):
        restore(state)
    for key, value in held.items():
        name, _, inner = key.partition(".")
        if name in names:  # else what wants it ends with its name
            setattr(names[name], inner, value)


def list_loaded(loaded, names):
    """The bodies that ``loaded`` stands for."""
    held = names.get(loaded, [])
    held = [*held] if isinstance(held, (list, tuple)) else [held]
    bodies = [O.bodies[one] if isinstance(one, int) else one for one in held]
    if loaded and not (bodies and all(isinstance(one, wrapper.Body) for one in bodies)):
        sys.exit(f"ERROR: loaded_body {loaded} holds no body where the cycle begins or ends")
    return bodies


def list_grains(loaded):
    """Spheres and clumps other than the loaded body; stops for others that move by themselves."""
    numbers = {one.id for one in loaded}
    grains = []
    for body in O.bodies:
        if body.id in numbers or body.isClumpMember:
            continue
        if body.isClump or isinstance(body.shape, wrapper.Sphere):
            grains.append(body)
        elif body.dynamic and body.shape is not None:
            kind = f"{body.id}, a {type(body.shape).__name__}"
            sys.exit(f"ERROR: body {kind}, moves by itself: jumps move spheres and clumps alone")
    return grains


def place(body, shift, rest):
    """Move a body, and the members of a clump with it; brought to ``rest`` or not."""
    state = body.state
    state.pos += yade.Vector3(*shift)
    members = body.shape.members.items() if body.isClump else ()
    inner = [(O.bodies[number].state, *relative) for number, relative in members]
    for one, where, turn in inner:
        one.pos, one.ori = state.pos + state.ori * where, state.ori * turn
    for one in (state, *(part[0] for part in inner)) if rest else ():
        one.vel = one.angVel = one.angMom = yade.Vector3.Zero


def move_grains(loaded):
    """Put grains and loaded body where ``moved.npz`` says, if it is there, grains at rest."""
    if not os.path.exists("moved.npz"):
        return
    with np.load("moved.npz") as data:
        for number, shift in zip(data["identifier"].tolist(), data["move"].tolist()):
            place(O.bodies[number], shift, rest=True)
        for body in loaded:
            place(body, (0, 0, -float(data["drop"])), rest=False)
    for engine in O.engines:
        if isinstance(engine, wrapper.Collider):
            engine()  # by itself it does not notice what moves by hand


def write_state(number, loaded, names, given):
    """Leave ``cycle_N.npz`` and ``cycle_N.restart``, the scene with the script's variables."""
    bodies = list_loaded(loaded, names)
    grains = list_grains(bodies)
    states = [one.state for one in grains]
    np.savez(
        f"cycle_{number}.npz",
        identifier=[one.id for one in grains],
        radius=[0.0 if one.isClump else one.shape.radius for one in grains],
        mass=[one.mass for one in states],
        position=[split_vector(one.pos) for one in states],
        velocity=[split_vector(one.vel) for one in states],
        height=np.mean([one.state.pos[2] for one in bodies]) if bodies else np.nan,
    )
    own = {name: one for name, one in names.items() if name not in given or one is not given[name]}
    values, lost = {}, []
    for name, value in (*own.items(), *list_held(own)):
        try:
            values[name] = pack(value)
        except TypeError:  # what a cycle misses then, ends it
            lost.append(name)
    values[LOST] = pack(lost)
    O.tags[TAG] = json.dumps(values).encode().hex()
    write_scene(f"cycle_{number}.restart")
    O.tags[TAG] = ""
