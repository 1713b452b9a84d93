"""The bed before it rains, the scene while it does, and of each stage of its load."""

from itertools import pairwise

from adapters.bed import FloatArray, draw_radii, draw_sample_start
from adapters.scene.ballast import place_stored_bed, read_stored_bed
from adapters.scene.procedures import fill_procedure
from adapters.scene.tables import Scene


def draw_start(scene: Scene) -> tuple[FloatArray, FloatArray, float]:
    """Centres (n, 3) and radii (n,) of a random start, and the height it fills [m]; of stones the
    spheres around them find room.  Those of a saved bed where the scene names one."""
    sample, reach = scene.sample, scene.form.reach
    if sample.state is not None:
        return place_stored_bed(read_stored_bed(sample.state), scene.container)
    radius = draw_radii(sample.radii, scene.grain_count, sample.seed)
    position, height = draw_sample_start(
        reach * radius, scene.container, sample.relative_density_start, sample.seed
    )
    return position, radius, height


def bound_friction(scene: Scene) -> Scene:
    """The scene while its bed rains and settles: with no more friction than ``rain_friction``."""
    most, material = scene.sample.rain_friction, scene.material
    if most is None:
        return scene
    parts = {
        name: one.model_copy(update={"friction": min(most, one.friction)}) for name, one in material
    }
    return scene.model_copy(update={"material": material.model_copy(update=parts)})


def list_stages(scene: Scene) -> list[tuple[int, Scene]]:
    """Of each stage of the load the cycles done before it, and a scene that ends with it.

    Of a procedure with a name each has jumps for its own number of cycles.
    """
    p, loading = scene.procedure, scene.loading
    if p is None or loading is None or not loading.stage:
        return [(0, scene)]
    begins = [0, *(stage.from_cycle for stage in loading.stage), p.total_cycles]
    found = []
    for level, (begin, end) in zip((loading, *loading.stage), pairwise(begins), strict=True):
        given = {"name": p.name, "k": p.k, "healing_cycles": p.healing_cycles}
        plan = fill_procedure(given | {"total_cycles": end - begin}) if p.name else {}
        own = {"k_i": plan["k_i"], "h": tuple(plan["h"])} if plan else {}
        load = {key: getattr(level, key) for key in ("amplitude", "mean", "frequency")}
        step = 1 / (load["frequency"] * scene.steps_per_cycle)
        parts = {
            "loading": loading.model_copy(update=load | {"stage": ()}),
            "procedure": p.model_copy(update=own | {"total_cycles": end}),
            "engine": scene.engine.model_copy(update={"time_step": step}),
        }
        found.append((begin, scene.model_copy(update=parts)))
    return found
