"""Islands: groups of contacts that can not feel each other, and so are solved apart.

Two contacts feel each other if W has an entry between them: if they share a body that can move.
A heap and a grain that flies off it are two islands; the ground joins nothing.  Methods whose
cost grows faster than the number of contacts gain most.

Islands come in the order of their smallest contact, and their contacts in the order of the
problem, so that nothing depends on how bodies were numbered.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp
from numba import njit

from rigid_lcp.arrays import Bools, Floats, Ints
from rigid_lcp.friction.linear import NO_LIMIT, Clock
from rigid_lcp.friction.problem import BodySpace, FrictionProblem, FrictionSolution, judge_forces
from rigid_lcp.friction.sweeps import NONE, solve_contacts_apart
from rigid_lcp.sparse import find_diagonal_blocks, split_csr

Method = Callable[..., FrictionSolution]

ISLAND_ROUNDS = 4
"""Times [-] the islands are solved, ten times finer each, until the whole is fine enough."""


def find_islands(problem: FrictionProblem) -> list[Ints]:
    """Contacts of every island, (contacts of it,) each, by W's pattern or by shared bodies."""
    if problem.contacts == 0:
        return []
    if problem.bodies is not None:
        first, body, block = problem.body_jacobians
        mass = find_diagonal_blocks(
            *split_csr(problem.bodies.inverse_mass), problem.bodies.body_size
        )
        joins = np.asarray(mass.any(axis=(1, 2)))[body] & block.any(axis=(1, 2))
        label = label_islands(first, problem.contacts + body, joins, problem.contacts + len(mass))
    else:
        w, dim = problem.delassus, problem.dim  # the rows of a contact stand one after another
        first, other = w.indptr[::dim].astype(np.int64), w.indices.astype(np.int64) // dim
        label = label_islands(first, other, w.data != 0.0, problem.contacts)
    if not label.any():
        return [np.arange(problem.contacts)]
    order = np.argsort(label, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(label[order])) + 1)


@njit(cache=True)
def label_islands(first: Ints, other: Ints, joins: Bools, count: int) -> Ints:
    """The least contact that each is joined to, (nc,), where k in first[c]:first[c + 1] joins c to
    other[k] < count: trees whose root is their least node, paths halved (Galler and Fischer 1964).
    """
    parent = np.arange(count)
    for c in range(len(first) - 1):
        for k in range(first[c], first[c + 1]):
            if joins[k]:
                a, b = c, other[k]
                while parent[a] != a:
                    parent[a] = parent[parent[a]]
                    a = parent[a]
                while parent[b] != b:
                    parent[b] = parent[parent[b]]
                    b = parent[b]
                parent[max(a, b)] = min(a, b)
    for c in range(len(first) - 1):
        parent[c] = parent[parent[c]]  # a parent is less than its child: already a root
    return parent[: len(first) - 1]


def cut_out_island(problem: FrictionProblem, contacts: Ints) -> FrictionProblem:
    """The problem of some contacts alone: their rows, and of the bodies only those they touch."""
    dim = problem.dim
    rows = list_contact_rows(contacts, dim)
    matrix = None if problem.matrix is None else sp.csr_array(problem.matrix[rows][:, rows])
    space = None
    if problem.bodies is not None:
        size = problem.bodies.body_size
        jacobian = sp.csr_array(problem.bodies.jacobian[rows])
        touched = np.unique(jacobian.indices // size)
        freedoms = list_contact_rows(touched, size)
        inverse_mass = problem.bodies.inverse_mass[freedoms][:, freedoms]
        space = BodySpace(sp.csr_array(jacobian[:, freedoms]), sp.csr_array(inverse_mass), size)
    return FrictionProblem(matrix, problem.offset[rows], problem.friction[contacts], dim, space)


def list_contact_rows(contacts: Ints, dim: int) -> Ints:
    """Rows of W that belong to some contacts (or freedoms that belong to bodies), in order."""
    return (np.asarray(contacts)[:, None] * dim + np.arange(dim)).ravel()


def join_islands(
    problem: FrictionProblem,
    parts: Sequence[Ints],
    solutions: Sequence[FrictionSolution],
    tolerance: float,
) -> FrictionSolution:
    """One solution from those of the islands, judged as a whole; their work is summed.

    The status is the worst of the islands': ``no solution`` of one is that of all.
    """
    force = np.zeros(problem.contacts * problem.dim)
    work: dict[str, float] = {"islands": float(len(parts))}
    for contacts, solution in zip(parts, solutions, strict=True):
        force[list_contact_rows(contacts, problem.dim)] = solution.r
        for name, count in solution.work.items():
            work[name] = work.get(name, 0.0) + count
    failed = [k for k, solution in enumerate(solutions) if not solution.solved]
    worst = next((k for k in failed if solutions[k].status == "no solution"), (failed or [-1])[0])
    largest = max(solutions, key=lambda solution: len(solution.r), default=None)
    method = largest.method if largest is not None else "islands"
    if not failed:
        return judge_forces(problem, force, tolerance, method, work)
    message = (
        f"{len(failed)} of {len(parts)} islands, that of contact {parts[worst][0]}: "
        + solutions[worst].message
    )
    status = solutions[worst].status
    return judge_forces(
        problem, force, tolerance, method, work, status=status, message=message
    )  # fmt: skip


def solve_islands(
    problem: FrictionProblem,
    method: Method,
    start: Floats | None = None,
    tolerance: float = 1e-12,
    clock: Clock = NO_LIMIT,
    **options: Any,
) -> FrictionSolution:
    """Solve every island apart by ``method(problem, start, tolerance, **options)``, and join them.

    Contacts that are islands of their own are solved exactly, without ``method``.  An island
    measures its residual by its own forces, the whole by all: where the whole comes out above
    ``tolerance`` although the islands did not, they are solved finer from where they are.  Small
    ones go first, none with more than an equal share of the time that ``clock`` leaves.
    """
    parts = find_islands(problem)
    if len(parts) == 1:
        return method(problem, start, tolerance, **options)
    force = np.zeros(problem.contacts * problem.dim) if start is None else np.array(start, float)
    single = np.array([part[0] for part in parts if len(part) == 1], dtype=np.int64)
    larger = [part for part in parts if len(part) > 1]
    problems = [cut_out_island(problem, part) for part in larger]
    alone = solve_singles(problem, single, tolerance)
    work: dict[str, float] = {}
    for round_ in range(ISLAND_ROUNDS):
        finer = tolerance * 0.1**round_
        begin: list[Floats | None] = [None] * len(larger)
        if start is not None or round_ > 0:
            begin = [force[list_contact_rows(part, problem.dim)] for part in larger]
        found: dict[int, FrictionSolution] = {}
        for k in sorted(range(len(larger)), key=lambda k: len(larger[k])):
            if clock is not NO_LIMIT:
                options["clock"] = clock.share(1.0 / (len(larger) - len(found)))
            found[k] = method(problems[k], begin[k], finer, **options)
        solutions = [found[k] for k in range(len(larger))]
        joined = join_islands(problem, [single, *larger], [alone, *solutions], tolerance)
        joined.work["islands"] = float(len(parts))
        for name, count in joined.work.items():
            work[name] = count if name == "islands" else work.get(name, 0.0) + count
        if joined.solved or not all(solution.solved for solution in solutions):
            break
        force = joined.r
    joined.work.update(work)
    return joined


def solve_singles(problem: FrictionProblem, contacts: Ints, tolerance: float) -> FrictionSolution:
    """Exact forces of contacts that feel no other, put together as a problem of their own."""
    dim = problem.dim
    apart = cut_out_island(problem, contacts)
    offset = apart.offset.reshape(-1, dim)
    local = find_diagonal_blocks(*split_csr(apart.delassus), dim)
    force, status = solve_contacts_apart(local, offset, apart.friction)
    lost = contacts[status == NONE]
    if len(lost) == 0:
        return judge_forces(apart, force.ravel(), tolerance, "local contact")
    return judge_forces(
        apart, force.ravel(), tolerance, "local contact", status="no solution",
        message=f"contact {lost[0]} has no force that obeys Coulomb's law, nor {len(lost) - 1} "
        "others\n  -> it is jammed (Painleve) or bears on no mass: solve at velocity level",
    )  # fmt: skip
