"""The share of a restitution that makes no energy, by bisection."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as some

from rigid_lcp.collision.restitution_scale import SHARE_RESOLUTION, Share

THRESHOLD = some.one_of(some.floats(0.0, 1.0), some.sampled_from((0.0, 0.5, SHARE_RESOLUTION, 1.0)))


@given(some.lists(THRESHOLD, min_size=1, max_size=8))
def test_each_contact_keeps_the_greatest_share_below_its_threshold(thresholds: list[float]) -> None:
    """Energy is made above a contact's threshold: 1 + log2(64) trials find it to 1/64, from below,
    and one more stands at all of them."""
    most = np.array(thresholds)
    share, trials = Share(len(most)), 1
    while share.next(share.now > most):
        trials += 1
    assert (share.now <= most).all()
    assert (share.now >= np.where(most < 1.0, most - SHARE_RESOLUTION, 1.0)).all()
    assert trials <= 8
    if (most == 1.0).all():
        assert trials == 1


def test_a_contact_that_gains_at_the_share_found_keeps_nothing() -> None:
    """Contact 0 gains while contact 1 has less than its whole restitution: no share below 1 is
    kept that makes energy."""
    share = Share(2)
    while share.next(np.array([share.now[0] > 0.0 and share.now[1] < 0.5, share.now[1] > 0.4])):
        pass
    assert share.now[0] == 0.0
    assert 0.4 - SHARE_RESOLUTION <= share.now[1] <= 0.4


def test_what_is_left_out_is_tried_once_more_and_then_kept() -> None:
    share = Share(3)
    share.leave_out()
    assert not share.now.any()
    assert not share.next(np.zeros(3, dtype=bool))
