"""LIGGGHTS (Debian's 3.8.0) as an engine: static decks, generated includes, fresh processes."""

import re
import shutil
from pathlib import Path

from adapters.bed import FloatArray
from adapters.engines import liggghts_decks, liggghts_stones
from adapters.engines.contract import EngineStart
from adapters.engines.decks import PISTON_MARGIN, DeckEngine, Parameters
from adapters.engines.plan import has_friction, has_rolling
from adapters.scene import Scene

BANNER = re.compile(r"(LIGGGHTS-PUBLIC (\d+)\.(\d+)[^,)]*)")


class LiggghtsEngine(DeckEngine):
    """Writes the decks of a window, runs ``liggghts``, and knows its manners.

    LIGGGHTS exits 0 after SIGTERM, with lost atoms and with NaN; the deck's last line
    ``COMPLETE step N`` is the sentinel looked for here, `adapters.procedure.checks` does the rest.
    ``-screen none`` crashes where a mesh is read, so the screen goes to a file.
    """

    name = "liggghts"
    auto_order = 0
    grain_steps_per_s = 3.5e6  # tens of thousands of grains on one core: docs/engines.md
    package = "liggghts_inputs"
    title, banner, oldest = "LIGGGHTS", BANNER, (3, 8)
    remedy = "sudo apt-get install liggghts"
    begun = BANNER
    launch = "launch it by the MPI it is linked to: Debian's by mpirun of Open MPI"
    stone_words = liggghts_stones.WORDS
    crib_words = ("crib scalar no yes no 0.0\nrun 0 post no", "property/atom crib", "f_crib")
    ended_early = "SIGINT/SIGTERM caught"

    def command(self, scene: Scene, deck: str) -> list[str]:
        """Command line that runs ``deck`` in its folder.

        ``stdbuf`` has the screen written line by line: MPI_ABORT throws away what is buffered,
        and with it the reason.
        """
        unbuffered = ["stdbuf", "-oL"] if shutil.which("stdbuf") else []
        words = ["liggghts", "-in", deck, "-log", "log.liggghts"]
        return [*scene.engine.launcher, *unbuffered, *words]

    def format_scene(self, scene: Scene, piston: bool) -> dict[str, str]:
        """``scene.in`` and ``dump_states.in``."""
        states = liggghts_decks.format_dump_states(self.wall_names(scene, piston))
        states += "include ${bodies_part}\n" * scene.stones
        return {"scene.in": liggghts_decks.format_scene(scene), "dump_states.in": states}

    def write_preparation(
        self, scene: Scene, position: FloatArray, radius: FloatArray, height: float, folder: Path
    ) -> dict[str, str]:
        """As of all engines, and ``stones.in`` where grains are stones."""
        if scene.stones:
            (folder / "stones.in").write_text(liggghts_stones.format_rain(scene, radius, height))
        return super().write_preparation(scene, position, radius, height, folder)

    def write_start(self, scene: Scene, start: EngineStart, folder: Path) -> Parameters:
        """The piston's mesh, and the moved grains."""
        margin = PISTON_MARGIN * scene.sample.radii.greatest
        liggghts_decks.write_piston_stl(
            folder / "piston.stl", scene.container, scene.piston_reach, margin, scene.piston_edges
        )
        own: Parameters = {
            "piston_mesh": f"piston_{start.piston_mesh}", "piston_height": start.piston_height
        }  # fmt: skip
        if scene.stones:
            own |= liggghts_stones.write_start(start, folder)
        elif start.moved is not None:
            own["start_step"] = start.time_step
            liggghts_decks.write_moved(scene.container, start, folder)
        return own

    def name_parts(self, scene: Scene) -> Parameters:
        """Contact law and output, with or without friction and resistance to rolling; stones."""
        kind = "frictional" if has_friction(scene) else "frictionless"
        kind = "rolling" if has_rolling(scene) else kind
        own: Parameters = {"contact_part": f"contact_{kind}.in", "output_part": f"output_{kind}.in"}
        if scene.stones:
            own |= {"motion_part": "motion_stones.in", "bodies_part": "dump_stones.in"}
            own["spheres"] = len(scene.form.radius)
        return own


ENGINE = LiggghtsEngine()
