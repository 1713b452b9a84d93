"""The verb ``trackbed sweep``; what it computes with is loaded when it runs."""

import argparse
from pathlib import Path

from adapters.cli.arguments import add_json, add_scene_arguments, list_overrides, print_json
from adapters.errors import SweepIncomplete, UsageError


def register(verb: str, parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``sweep``."""
    add_scene_arguments(parser)
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=V1,V2,...", dest="assignments",
        help="values of a key of the scene, such as loading.frequency=10,20,50; may be repeated, "
        "every combination is a member",
    )  # fmt: skip
    parser.add_argument(
        "--seeds", type=int, metavar="N",
        help="so many samples of each, or kilometres of a line, seeds counted up from the scene's",
    )  # fmt: skip
    parser.add_argument(
        "--into", type=Path, required=True, metavar="FOLDER",
        help="members, tables and picture; a sweep that is there is continued",
    )  # fmt: skip
    parser.add_argument(
        "--scheduler", default="local", metavar="WHERE",
        help="local (default: side by side here), slurm, or the address of a Dask scheduler",
    )  # fmt: skip
    parser.add_argument(
        "--cluster-config", type=Path, metavar="FILE",
        help="TOML with the keywords of dask_jobqueue.SLURMCluster, for --scheduler slurm",
    )  # fmt: skip
    parser.add_argument(
        "--workers", type=int, metavar="N",
        help="members at a time on this machine (default: its processors), or SLURM jobs",
    )  # fmt: skip
    parser.add_argument(
        "--dry-run", action="store_true", help="check every member and print its command"
    )
    add_json(parser)
    parser.set_defaults(command=run_sweep_command, overrides=[])


def run_sweep_command(arguments: argparse.Namespace) -> int:
    """Run a sweep; `SweepIncomplete` when a member failed, after all others are finished."""
    from adapters.procedure import Progress, sweep

    if arguments.workers is not None and arguments.workers < 1:
        raise UsageError("there must be a worker at least", where="--workers")
    if arguments.cluster_config is not None and arguments.scheduler != "slurm":
        raise UsageError("it is read for --scheduler slurm only", where="--cluster-config")
    plan = sweep.plan_sweep(
        arguments.scene, arguments.into, arguments.assignments, arguments.seeds,
        list_overrides(arguments),
    )  # fmt: skip
    if arguments.dry_run:
        sweep.check_folder(plan)
        print("\n".join(sweep.list_dry_run(plan)))
        return 0
    sweep.check_libraries(arguments.scheduler)
    cluster = sweep.Cluster(arguments.scheduler, arguments.cluster_config, arguments.workers)
    progress = Progress()
    warnings = (text for one in plan.members for text in getattr(one.scene, "warnings", ()))
    for warning in dict.fromkeys(warnings):
        progress.print_line(f"warning: {warning}")
    results = sweep.run_sweep(plan, cluster, progress)
    bands, paths = sweep.write_results(plan, results)
    bands = [band for band in bands if len(band.cycle)]
    if arguments.json:
        last = [
            {
                "settings": dict(band.settings), "seeds": band.seeds, "cycle": int(band.cycle[-1]),
                "loaded_body_m": float(band.mean[-1]), "band_m": band.half_at_end,
            }
            for band in bands
        ]  # fmt: skip
        print_json(
            sweep.make_sweep_record(plan, cluster, results) | {"settlements": last, "files": paths}
        )
    else:
        for band in bands:
            half = band.half_at_end
            spread = "" if half is None else f" +- {1e6 * half:.2f}"
            print(
                f"{band.group}: {1e6 * band.mean[-1]:.2f}{spread} um at cycle "
                f"{band.cycle[-1]:.0f}, {band.seeds} of {band.asked} seeds"
            )
        print("\n".join(paths.values()))
    failed = [result for result in results if result.state != "finished"]
    if failed:
        lines = [f"  {one.member}, exit code {one.exit_code}: {one.sentence}" for one in failed]
        raise SweepIncomplete(
            f"{len(failed)} of {len(results)} members failed, the others are finished:\n"
            + "\n".join(lines),
            where=str(arguments.into),
            remedy="remove the cause and give the same command again: it runs only these",
        )
    return 0
