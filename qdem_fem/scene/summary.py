"""What a run came to, in figures: the content of ``result.json`` and of the report."""

from math import isfinite
from typing import Any

import numpy as np

from qdem_fem.files import Floats, Series, read_table, warn_user
from qdem_fem.report import Mode, find_peak_frequencies
from qdem_fem.scene.doubts import sort_by_kind
from qdem_fem.scene.energy_account import list_energy_facts
from qdem_fem.scene.run import Done, RunFolder
from qdem_fem.tables import Prepared

MOVING = 1e-3  # share of the greatest displacement below which a component does not move [-]
PERIODS = 2  # that a record holds at least of a mode: with fewer a drift fits as well [-]
SAMPLED = 256  # elements of a body, most, whose own steps are compared [-]
HOLDS = ("fix", "prescribe", "roller")  # conditions under which a body does not fly off
FREE_SAMPLES = 50  # of free motion at least, for modes to be sought in it [-]


def summarise_run(prepared: Prepared, done: Done, folder: RunFolder) -> dict[str, Any]:
    """All figures of a finished run; SI units, ready for JSON."""
    run, cost = done.run, done.cost
    elements = sum(len(body.elements) for body in done.bodies.values() if not body.rigid)
    steps = 0 if done.plan is None else done.plan.total
    rows, energy = (read_table(folder.path / name) for name in ("probes.csv", "energy.csv"))
    return {
        "title": prepared.scene.title,
        "method": prepared.scene.simulation.method,
        "time": float(run.time) if steps else 0.0,
        "step": float(run.step) if steps else None,
        "steps": steps,
        "critical_step": describe_critical_step(run),
        "mass_scaling": list_mass_scaling_facts(run),
        "bodies": list_body_facts(done.bodies),
        "cost": {**cost, "million_elements_per_s": elements * steps / 1e6 / cost["wall_s"]}
        if elements * steps and cost["wall_s"]
        else dict(cost),
        "energy": list_energy_facts(energy),
        "probes": {
            name: {
                "end": [float(column[-1]) for column in columns],
                "least": [float(column.min()) for column in columns],
                "greatest": [float(column.max()) for column in columns],
            }
            for name in prepared.probes
            if (columns := [rows[f"{name}_{axis}"] for axis in "xyz"])
        },
        "modes": {
            label: [vars(mode) for mode in modes]
            for label, modes in find_modes(prepared, rows).items()
        },
        "static": done.static,
        "discretisation": {
            name: getattr(done.discretisation, name)
            for name in ("displacement", "stress", "frequency")
            if done.discretisation is not None  # without elastic energy there are none
        },
        "left_out": prepared.scene.list_left_out(),
    }


def describe_critical_step(run: Any) -> dict[str, Any]:
    """The critical step [s], what it hangs on, and its share that is used; None: there is none."""
    critical = run.critical_step
    finite = isfinite(critical.value)
    return {
        "value": float(critical.value) if finite else None,
        "omega": float(critical.omega),
        "body": str(critical.body),
        "element": int(critical.element),
        "governor": critical.governor,
        "remark": str(critical.remark),
        "share_used": float(run.step) / float(critical.value) if finite else 0.0,
    }


def list_mass_scaling_facts(run: Any) -> dict[str, float]:
    """Mass that scaling added [kg], and its share of the bodies' own; empty without scaling."""
    if run.mass_scaling is None:
        return {}
    own = {body.name: describe_body(body)["mass"] for body in run.bodies}
    added = sum(own[name] * share for name, share in run.added_mass.items())
    return {"added_mass": float(added), "share": float(added / sum(own.values()))}


def list_body_facts(bodies: dict[str, Any]) -> dict[str, Any]:
    """`describe_body` by name; of bodies that are named alike but for a number behind a dash, one
    entry: sums, and the smallest altitude."""
    found: dict[str, Any] = {}
    for kind, alike in sort_by_kind(bodies).items():
        facts = list(map(describe_body, alike))
        if len(facts) == 1:
            found[alike[0].name] = facts[0]
            continue
        least = min(facts, key=lambda one: float(one["smallest_altitude"]))
        own = ("element", "gain", "smallest_altitude", "thinnest_element")
        total = {k: least[k] if k in own else sum(one[k] for one in facts) for k in facts[0]}
        found[f"{len(facts)} of {kind}"] = total
    return found


def describe_body(body: Any) -> dict[str, Any]:
    """Figures of a body's mesh: element and what it gains, counts, what was mended, smallest
    altitude [m], mass [kg]."""
    from qdem_fem.mesh import find_altitudes

    gradients, volumes = body.gradients
    altitude = find_altitudes(gradients)
    thinnest = int(np.argmin(altitude))
    return {
        "element": body.ELEMENT,
        "gain": describe_gain(body),
        "nodes": len(body.nodes),
        "elements": len(body.elements),
        "surface_faces": len(body.surface),
        "flipped": len(body.mesh.flipped),
        "unused_nodes": len(body.mesh.unused),
        "smallest_altitude": float(altitude[thinnest]),
        "thinnest_element": thinnest,
        "volume": float(volumes.sum()),
        "mass": float((volumes * body.material.density).sum()),
    }


def describe_gain(body: Any) -> str:
    """What quadratic elements spare a body that bends, and at what cost; of linear ones nothing."""
    from qdem_fem.bodies import Body, estimate_bending, find_element_step

    if body.ELEMENT == "linear":
        return ""
    linear = Body(body.mesh, body.material)
    part = slice(None, None, 1 + len(body.elements) // SAMPLED)
    longer = np.median(find_element_step(linear, part) / find_element_step(body, part))
    return (
        f"linear elements of this mesh would bend about {100 * estimate_bending(linear):.0f} % "
        f"too little, in steps {longer:.2g} times as long; no error of quadratic ones is "
        "estimated: compare with a finer mesh"
    )


def find_moving_components(rows: dict[str, Floats]) -> list[str]:
    """Columns of probes.csv whose range is not negligible, in the order of the file."""
    ranges = {name: float(np.ptp(column)) for name, column in rows.items() if name != "time"}
    least = MOVING * max(ranges.values(), default=0.0)
    return [name for name, extent in ranges.items() if extent > least]


def find_free_start(prepared: Prepared) -> float:
    """Time [s] from which no load, pressure or prescribed displacement changes any more."""
    series = [
        value
        for step in prepared.conditions
        for value in step.arguments
        if isinstance(value, Series) and len(value.times) > 1
    ]
    return max((float(one.times[-1]) for one in series), default=0.0)


def find_modes(prepared: Prepared, rows: dict[str, Floats]) -> dict[str, list[Mode]]:
    """Modes in the free motion of each probe's strongest component, by column name."""
    count = prepared.scene.output.modes
    free = rows["time"] >= find_free_start(prepared)
    found: dict[str, list[Mode]] = {}
    if not count or free.sum() < FREE_SAMPLES:
        return found
    time = rows["time"][free]
    held = {step.body for step in prepared.conditions if step.verb in HOLDS}
    for name, (body, _) in prepared.probes.items():
        motion = {f"{name}_{axis}": rows[f"{name}_{axis}"][free] for axis in "xyz"}
        if body not in held:  # that it flies or falls is no mode
            motion = {one: values - find_drift(time, values) for one, values in motion.items()}
        column = max(motion, key=lambda one: float(np.ptp(motion[one])))
        modes = find_peak_frequencies(time, motion[column], count)
        span = float(time[-1] - time[0])
        short = [mode for mode in modes if mode.frequency * span < PERIODS]
        if short:
            warn_user(
                f"{column}: {span:.3g} s of free motion are too short for a frequency of "
                f"{short[0].frequency:.3g} Hz, of which they hold {short[0].frequency * span:.2g} "
                f"periods and need {PERIODS}; raise simulation.duration"
            )
        elif not modes:
            warn_user(f"{column}: no frequency stands out in {span:.3g} s of free motion")
        if modes := [mode for mode in modes if mode not in short]:
            found[column] = modes
    return found


def find_drift(time: Floats, values: Floats) -> Floats:
    """The parabola of a body that flies, falls or turns a little, through its record (k,)."""
    return np.asarray(np.polynomial.Polynomial.fit(time, values, 2)(time))
