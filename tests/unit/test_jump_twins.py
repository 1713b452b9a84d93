"""Jumps by tolerance beside twins: what the bed would have gained, from the state before a jump."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from adapters.run_folder import Outcome
from validation.jump_twins import Jump, Twin, by_way, jumps_of, jumps_read, main, twins_told


def jump(*twins: float, gained: float = 3.0, made_good: float = 0.0) -> Jump:
    """A jump to a settlement of 20 m, of which tolerance 0.1 allows 2 m."""
    head = "tolerance 0.1", 1, 100, 125
    return Jump(*head, gained, 20.0, made_good, np.array(twins))


def test_the_mean_of_the_twins_is_what_the_bed_would_have_gained() -> None:
    """3 m beside 1, 2 and 3 m: 1 m too much, within 2 m; beside 0, 0 and 1.5 m: 2.5 m, not."""
    near, far = jump(1.0, 2.0, 3.0), jump(0.0, 0.0, 1.5)
    assert (near.allowed, near.error, near.within) == (2.0, 1.0, True)
    assert (far.error, far.within) == (2.5, False)


def test_what_makes_good_earlier_jumps_is_no_error_of_this_one() -> None:
    """Of 2.5 m too much 1 m was to make up for earlier jumps that fell short; and the reverse."""
    assert jump(0.5, made_good=1.0).forecast_error == 1.5
    assert jump(0.5, made_good=1.0).within
    assert not jump(3.0, gained=2.0, made_good=1.5).within


def test_twins_are_compared_with_the_others() -> None:
    """0, 3 and 6 m beside the means of the other two, 4.5, 3 and 1.5 m."""
    assert jump(0.0, 3.0, 6.0).twin_errors == pytest.approx([-4.5, 0.0, 4.5])


@pytest.mark.parametrize(("twins", "side"), [((4.0, 5.0), 1), ((1.0, 2.0), -1), ((2.0, 4.0), 0)])
def test_twins_on_one_side(twins: tuple[float, ...], side: int) -> None:
    """Of a run that gained 3 m, and of one that gained 1 m more to make good earlier jumps."""
    assert jump(*twins).side == side
    assert jump(*twins, gained=4.0, made_good=1.0).side == side


def run() -> dict[str, Any]:
    """A run by tolerance: a jump from 100 to 120 that was taken back once, 5 healing cycles."""
    rows = [[100, "c", 10.0], [120, "j", 11.0], *([120 + n, "h", 11.0 + n] for n in range(1, 6))]
    decided = [{"cycle": 100, "attempt": n, "made_good": n / 4} for n in (1, 2)]
    checks = [{"cycle": 100, "attempt": n, "accepted": n == 2} for n in (1, 2)]
    return {
        "way": "tolerance 0.1", "seed": 1, "rows": [*rows, [126, "c", 17.0]],
        "decisions": decided, "checks": checks,
    }  # fmt: skip


def twin(member: int, gained: float, **other: Any) -> dict[str, Any]:
    place = {"way": "tolerance 0.1", "seed": 1, "first": 100, "last": 125}
    return place | {"member": member, "gained": gained} | other


def test_jumps_are_read_with_their_twins() -> None:
    """From 10 to 16 m by the attempt that stands; twins of another place are another's; one twin
    tells no scatter."""
    rows = [twin(1, 5.0), twin(2, 7.0), twin(3, 9.0, seed=2), twin(3, 9.0, first=90)]
    (one,) = jumps_read([run()], rows)
    assert (one.first, one.last, one.gained, one.settled) == (100, 125, 6.0, 16.0)
    assert one.made_good == 0.5
    assert one.twins.tolist() == [5.0, 7.0]
    assert jumps_read([run()], rows[:1]) == []
    assert by_way([one]) == {"tolerance 0.1": [one]}


def test_what_is_told_of_them() -> None:
    """One of two within, the other less than both of its twins."""
    told = twins_told([jump(2.0, 3.0), jump(7.0, 8.0)])
    assert told["twins"].startswith("1 of 2 (50 %")
    assert told["twins_chaos"] == "100 % at tolerance 0.1"
    assert told["twins_sum"] == "0.60 times what their twins do at tolerance 0.1"  # 6 of 2.5 + 7.5
    assert told["twins_sides"] == (
        "in 1 of 2 jumps at tolerance 0.1 (in 0 it gains more, in 1 less; by chance in 1)"
    )


def test_jumps_of_a_finished_run() -> None:
    """From the cycle before a jump to the last healing one of the window behind it."""
    healing = [{"kind": "healing"}] * 5 + [{"kind": "computed"}] * 10
    outcomes = [
        Outcome("window", 50, 100, [], {}),
        Outcome("jump", 100, 120, [], {}),
        Outcome("window", 120, 135, healing, {}),
    ]
    assert list(jumps_of(outcomes)) == [(100, 125)]


def test_twins_in_the_record_are_not_run_again(
    tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is missing is appended, with where it came from."""
    planned = [Twin("tolerance 0.1", 1, 100, 125, member) for member in (1, 2)]
    monkeypatch.setattr("validation.jump_twins.plan", lambda work, members: iter(planned))
    asked: list[Twin] = []

    def made(one: Twin, work: Any) -> dict[str, float]:
        asked.append(one)
        return {"gained": 1.0, "cpu_s": 2.0}

    monkeypatch.setattr("validation.jump_twins.twin_run", made)
    words = ["--work", str(tmp_path), "--record", str(tmp_path / "record.jsonl")]
    for _ in range(2):
        main(words)
    assert asked == planned
