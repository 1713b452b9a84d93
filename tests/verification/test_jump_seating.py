"""Whether the bed carries its piston: the mean field, and runs that wait for it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from adapters.bed.state import FloatArray
from adapters.engines import fake as engine_fake
from adapters.engines.fake import SETTLEMENT, FakeBed
from adapters.errors import SceneError
from adapters.files.run_folder import Outcome, RunFolder
from adapters.jumps.rates import Stretch
from adapters.jumps.slopes import SLOPES, Jumped, SlopeNumbers
from adapters.procedure import forecast
from adapters.procedure import run as procedure
from adapters.procedure import seating as jump_seating
from adapters.procedure.progress import Progress
from adapters.procedure.record import DECISION
from adapters.procedure.seating import (
    CONSTRAINED,
    compare_deflection,
    estimate_constrained_modulus,
    find_hung_cycles,
)
from adapters.scene.file import load_scene
from adapters.scene.tables import Scene
from tests.small_bed import read_rows
from trackbed.scenes import find_scene_file

COARSE = find_scene_file("karrech-coarse")
HANGS = 30.0


def test_modulus_is_that_of_spheres_that_move_with_the_mean_strain() -> None:
    """Hydrostatic strain e of equal spheres: delta = 2 R e, F = (4/3) E* sqrt(R/2) delta^(3/2),
    E* = E / 2 (1 - nu^2), p = phi Z F / (4 pi R^2) by Love's formula; K = (1/3) dp/de.

    Central difference of relative step 1e-5: error 1e-10 of dp/de.
    """
    young, poisson, density, coordination, radius = 46.9e9, 0.25, 0.57, 4.7, 3.2e-3

    def pressure(strain: float) -> float:
        stiffness = 4 / 3 * young / (2 * (1 - poisson**2)) * np.sqrt(radius / 2)
        force = stiffness * (2 * radius * strain) ** 1.5
        return float(density * coordination * force / (4 * np.pi * radius**2))

    strain = 3e-5
    bulk = (pressure(strain * (1 + 1e-5)) - pressure(strain * (1 - 1e-5))) / (6e-5 * strain)
    columns = (np.array([value]) for value in (density, coordination))
    found = estimate_constrained_modulus(young, poisson, *columns, pressure(strain))
    assert found / CONSTRAINED == pytest.approx([bulk], rel=1e-8)


def test_constrained_over_bulk_modulus_of_smooth_spheres() -> None:
    """Contacts of one stiffness in all directions: M goes as <n_z^4>, K as <(n.n)^2> / 9; over
    the sphere n_z is even in [-1, 1]."""
    fourth = quad(lambda z: z**4, 0, 1)[0]
    assert pytest.approx(fourth / (1 / 9)) == CONSTRAINED


def rows_like(scene: Scene, count: int = 3, **columns: float) -> list[dict[str, Any]]:
    """Rows of a table whose bed has the mean field's deflection, 0.1 m high, unless told."""
    given = {"relative_density": 0.57, "coordination_number": 4.5, "piston_height": 0.1} | columns
    stress = scene.stress_at(np.linspace(0, 1, 1001))
    grain = scene.material.grain
    density, coordination = (
        np.array([given[name]]) for name in ("relative_density", "coordination_number")
    )
    modulus = partial(
        estimate_constrained_modulus, grain.young, grain.poisson, density, coordination
    )
    strain, _ = quad(lambda s: 1 / modulus(s)[0], float(stress[-1]), float(stress.max()))
    given = {"elastic_deflection": strain * given["piston_height"]} | given
    return [{"cycle": n + 1, "kind": "computed", **given} for n in range(count)]


def test_deflection_of_the_mean_field() -> None:
    """The integral of ds / M(s) in closed form, by quadrature: 1e-6 for the root at zero stress;
    a load that does not come back to zero too."""
    for mean in ("7075.0", "30000.0"):
        scene = load_scene(COARSE, [f"loading.mean={mean}"])
        found = compare_deflection(scene, rows_like(scene))
        assert found == pytest.approx(np.ones(3), rel=1e-6)


@pytest.mark.parametrize("shift", [0.0, 0.2, 0.25, 0.5])
def test_a_load_series_may_begin_anywhere(tmp_path: Path, shift: float) -> None:
    """The deflection counts from the cycle's end: the mean field's is 1 there, by 2,001
    samples of a sine; nothing is said where the load is greatest at a cycle's end."""
    time = np.linspace(0, 0.02, 2001)
    stress = 7075 - 7075 * np.cos(2 * np.pi * (time / 0.02 + shift))
    stress[-1] = stress[0]
    path = tmp_path / "load.csv"
    table = np.column_stack([time, stress])
    np.savetxt(path, table, "%.17g", ",", header="time,stress", comments="")
    before, _, behind = COARSE.read_text(encoding="utf-8").partition("[loading]")
    own = f'[loading]\nwaveform = "series"\nseries = "{path}"\npiston_mass = 0.1\n\n'
    file = tmp_path / "scene.toml"
    file.write_text(before + own + behind[behind.index("[procedure]") :], encoding="utf-8")
    scene = load_scene(file, [])
    found = compare_deflection(scene, rows_like(scene, 1))
    assert found == pytest.approx([np.nan if shift == 0.5 else 1.0], rel=1e-4, nan_ok=True)


def test_what_does_not_count() -> None:
    """Of 20 first cycles the first four take the load for the first time; a bed without contacts
    has no stiffness and no ratio."""
    scene = load_scene(COARSE, ["procedure.k_i=20"])
    rows = rows_like(scene, 30)
    rows[-1]["coordination_number"] = 0.0
    assert np.isnan(compare_deflection(scene, rows)).tolist() == [False] * 29 + [True]
    for number, kind in ((4, "computed"), (6, "computed"), (9, "healing"), (12, "jumped")):
        rows[number - 1] |= {"kind": kind, "elastic_deflection": 1.0}
    assert find_hung_cycles(scene, [Outcome("window", 0, 30, rows, {})]).tolist() == [6]


def hang(monkeypatch: pytest.MonkeyPatch, hung: Callable[[FloatArray], Any]) -> None:
    """Have the piston hang in cycles told."""

    def compare(_: Scene, rows: list[dict[str, Any]]) -> FloatArray:
        return np.where(hung(np.array([row["cycle"] for row in rows], float)), HANGS, 1.0)

    monkeypatch.setattr(jump_seating, "compare_deflection", compare)


def settle(
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    hung: tuple[int, int],
    *overrides: str,
    control: bool = False,
) -> tuple[list[tuple[int, int]], list[dict[str, str]], list[str]]:
    """The coarse scene on the fake engine whose piston hangs from one cycle to another.

    Jumps (cycles done before and behind), rows of the table, what was said.
    """

    hang(monkeypatch, lambda cycle: (cycle >= hung[0]) & (cycle <= hung[1]))
    said: list[str] = []
    progress = Progress(quiet=True)
    monkeypatch.setattr(progress, "print_line", said.append)
    procedure.run_scene(
        COARSE,
        folder,
        control=control,
        overrides=['engine.name="fake"', "procedure.k_i=10", "procedure.k=5", *overrides],
        progress=progress,
    )
    outcomes = RunFolder(folder).outcomes()
    jumps = [(one.first_cycle, one.last_cycle) for one in outcomes if one.stage == "jump"]
    return jumps, read_rows(folder), said


FIXED = ("procedure.h=60", "procedure.healing_cycles=2", "procedure.total_cycles=82")
WAITS = 'procedure.seating="waits"'


def test_a_run_waits_until_the_bed_has_carried_its_piston_for_k_i_cycles(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """k_i = 10, k = 5, h = 60 of 82 cycles.  Hung until 23: windows of five to 35, one more, and a
    jump over what is left but healing and a last window, 40 to 75; else the jump is 15 to 75."""
    hung, seated = (1, 23), (1, 2)
    assert settle(tmp_path / "never", monkeypatch, seated, *FIXED, WAITS)[0] == [(15, 75)]
    jumps, rows, said = settle(tmp_path / "hung", monkeypatch, hung, *FIXED, WAITS)
    assert jumps == [(40, 75)]
    assert {int(row["cycle"]) for row in rows} >= set(range(1, 41))
    assert any("hung on few grains until cycle 23" in words for words in said)
    jumps, _, said = settle(tmp_path / "any", monkeypatch, hung, *FIXED)
    assert jumps == [(15, 75)]
    assert sum(words.startswith("warning: the piston hung") for words in said) == 1
    _, _, said = settle(tmp_path / "any", monkeypatch, hung, *FIXED)
    assert not any("hung" in words for words in said)


def test_cycles_that_count_in_place_of_k_i(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Hung until 23, 4 cycles and k = 5 behind it: a jump from 35, where k_i = 10 has one from 40;
    nothing changes where no piston hung, and without waiting the key is refused."""
    key = "procedure.seating_cycles=4"
    for name, hung, start in (("hung", (1, 23), 35), ("never", (1, 2), 15)):
        folder = tmp_path / name
        assert settle(folder, monkeypatch, hung, *FIXED, WAITS, key)[0] == [(start, 75)]
    with pytest.raises(SceneError, match="only a run that waits for its piston counts them"):
        settle(tmp_path / "any", monkeypatch, (1, 23), *FIXED, key)


def test_few_seating_cycles_beside_a_large_k_i_leave_cycles_to_forecast_from(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """k_i = 100 would leave out 20 cycles behind the last hung one, of which 4 + 5 are computed:
    four are left out, and five tell the jump from there on."""
    keys = ("procedure.k_i=100", "procedure.seating_cycles=4", 'procedure.settlement="history"')
    rest = ("procedure.h=60", "procedure.healing_cycles=2", "procedure.total_cycles=200", WAITS)
    jumps, _, _ = settle(tmp_path / "run", monkeypatch, (1, 121), *keys, *rest)
    assert jumps == [(130, 190)]
    with pytest.raises(SceneError, match="never jumps"):
        settle(tmp_path / "no", monkeypatch, (1, 2), "procedure.seating_cycles=82", *FIXED, WAITS)


def test_a_piston_that_hangs_again_is_waited_for_again(tmp_path, monkeypatch) -> None:
    """Jumps of 10 from 15; hung in cycles 45 to 47: no jump before cycle 62.  A run that is asked
    to go on finds its stages, and decides as before, whatever came later."""
    keys = ("procedure.h=10", "procedure.healing_cycles=2", "procedure.total_cycles=99", WAITS)
    jumps, rows, _ = settle(tmp_path / "run", monkeypatch, (45, 47), *keys)
    assert jumps[:2] == [(15, 25), (32, 42)]
    assert all(first >= 62 for first, _ in jumps[2:])
    assert len(jumps) > 2
    again = settle(tmp_path / "run", monkeypatch, (45, 47), *keys)
    assert again[:2] == (jumps, rows)


def test_a_piston_that_hangs_to_the_end_has_every_cycle_computed(tmp_path, monkeypatch) -> None:
    """No jump, and the closed form's settlement exactly."""
    jumps, rows, _ = settle(tmp_path / "run", monkeypatch, (1, 99), *FIXED, WAITS)
    assert not jumps
    assert float(rows[-1]["mean_grain_settlement"]) == pytest.approx(
        SETTLEMENT * np.log(83), rel=1e-3
    )


def test_history_begins_where_the_bed_carries_its_piston(tmp_path, monkeypatch) -> None:
    """A bed that takes the load from cycle 23 on, u = a ln(1 + N - 23).  Nothing of the cycles
    until then is known to the jump: those of 25 to 40 are, counted from 23, and the gain
    a ln(53 / 18) follows, to the 5 % that ln N differs from ln(1 + N); counted from the first
    cycle it would be 1.3 times that.  Where the piston hangs again, nothing is owed for jumps
    before."""
    asked: list[tuple[int, int, list[int]]] = []
    real = forecast.find_asked_gain

    def gain(
        known: Sequence[Stretch], h: int, jumps: Sequence[Jumped], numbers: SlopeNumbers
    ) -> float:
        if numbers is SLOPES:  # of the mean grain: the loaded body's begins there too
            before = [int(one.cycles[0]) for one in jumps]
            asked.append((known[0].first_cycle, known[-1].last_cycle, before))
        return real(known, h, jumps, numbers)

    monkeypatch.setattr(forecast, "find_asked_gain", gain)
    history = (WAITS, 'procedure.settlement="history"')
    with monkeypatch.context() as late:
        taken = FakeBed(lambda n: SETTLEMENT * np.log1p(np.clip(n - 23, 0, None)))
        late.setattr(engine_fake, "BED", taken)
        settle(tmp_path / "run", monkeypatch, (1, 23), *FIXED, *history)
    assert asked == [(2, 17, [])]
    jump = RunFolder(tmp_path / "run").outcome("jump_000040_1")
    assert jump is not None
    assert jump.notes["gain"] == pytest.approx(SETTLEMENT * np.log(53 / 18), rel=0.05)
    asked.clear()
    keys = ("procedure.h=10", "procedure.healing_cycles=2", "procedure.total_cycles=99")
    settle(tmp_path / "again", monkeypatch, (45, 47), *keys, *history)
    assert [before for _, _, before in asked[:3]] == [[], [15], []]
    assert asked[2][0] == 49 - 47
    assert asked[3][2] == [asked[2][1]]


def by_tolerance(
    folder: Path, monkeypatch: pytest.MonkeyPatch, seating: str, hung: Callable[[FloatArray], Any]
) -> RunFolder:
    """Jumps by a tolerance of .1 on the fake engine whose piston hangs in cycles told."""

    hang(monkeypatch, hung)
    text = COARSE.read_text(encoding="utf-8")
    kept = [line for line in text.splitlines() if not line.startswith(("k =", "h ="))]
    scene = folder.with_suffix(".toml")
    scene.write_text("\n".join(kept) + "\n", encoding="utf-8")
    keys = ["procedure.tolerance=0.1", "procedure.total_cycles=200", "procedure.k_i=20"]
    overrides = ['engine.name="fake"', *keys, f'procedure.seating="{seating}"']
    procedure.run_scene(scene, folder, overrides=overrides, progress=Progress(quiet=True))
    return RunFolder(folder)


@pytest.mark.long
def test_self_chosen_jumps_wait_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By tolerance: the first jump no earlier than k_i cycles behind the last hung one; where the
    piston hangs again, cycles are computed in place of the jump that was due."""
    first = {}
    for name in ("any", "waits"):
        folder = by_tolerance(
            tmp_path / name, monkeypatch, name, lambda n: (n <= 33) | ((n >= 64) & (n < 74))
        )
        first[name] = [one.first_cycle for one in folder.outcomes() if one.stage == "jump"]
    assert first["any"][0] < 53 <= first["waits"][0]
    assert all(not 64 <= cycle < 94 for cycle in first["waits"])


def test_a_piston_that_creeps_while_it_hangs_is_no_ratcheting_bed(tmp_path, monkeypatch) -> None:
    """It sinks by 1 um a cycle from 40 to 80, hung, and the bed goes by its logarithm before and
    behind.  The run waits; nothing of those cycles is left among what the jumps behind are
    decided from, so that the rate goes as 1/N (beta within .1 of zero)."""
    creep = FakeBed(lambda n: SETTLEMENT * np.log1p(n) + 1e-6 * np.clip(n - 40, 0, 40))
    monkeypatch.setattr(engine_fake, "BED", creep)
    folder = by_tolerance(tmp_path / "run", monkeypatch, "waits", lambda n: (n > 40) & (n <= 80))
    decided = [event for event in folder.events() if event["event"] == DECISION]
    behind = [event for event in decided if event["cycle"] >= 100 and event["exponent"]]
    assert not any(event["action"] == "refuse" for event in decided)
    assert any(event["action"] == "jump" for event in behind)
    assert all(abs(event["exponent"]) < 0.1 for event in behind)
    jumps = [one for one in folder.outcomes() if one.stage == "jump"]
    assert all(not 40 < one.first_cycle < 100 for one in jumps)


def test_a_control_shares_the_cycles_that_were_waited_for(tmp_path, monkeypatch) -> None:
    """Hung until 23, jump from 40: the control computes from there, and its first 40 cycles are
    the procedure's."""
    settle(tmp_path / "run", monkeypatch, (1, 23), *FIXED, WAITS, control=True)
    own, control = RunFolder(tmp_path / "run"), RunFolder(tmp_path / "run" / "control")
    names = [f"window_{cycle:06d}" for cycle in (0, 10, 15, 20, 25, 30, 35)]
    assert own.stage_names()[1:8] == control.stage_names()[1:8] == names
    for name in names:
        assert (control.path / name / "states.npz").samefile(own.path / name / "states.npz")
    assert max(one.last_cycle for one in control.outcomes()) == 82
    assert all(one.stage != "jump" for one in control.outcomes())
