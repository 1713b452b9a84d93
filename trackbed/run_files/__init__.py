"""Run folders: one lock, whole files with digests, provenance, signals."""

from trackbed.run_files import folder
from trackbed.run_files.arguments import (
    Progress,
    add_run_arguments,
    make_manifest,
    open_run,
    place_run,
    time_step,
)
from trackbed.run_files.folder import (
    MANIFEST,
    PLOT,
    RESULT,
    is_written,
    list_changed_tables,
    list_differences,
    lock_folder,
    refuse_format,
    refuse_links,
    write_result,
)
from trackbed.run_files.provenance import record_provenance
from trackbed.run_files.signals import hold_signals, note_interrupts, note_signals, raise_on_signals
from trackbed.run_files.whole import (
    SEAL,
    append_text,
    digest_file,
    open_seal,
    open_unlinked,
    read_object,
    refuse_writing,
    replace_file,
    seal_file,
    seal_record,
    sync_folder,
    write_csv,
    write_pvd,
    write_whole,
)

__all__ = [
    "MANIFEST", "PLOT", "RESULT", "SEAL", "Progress", "add_run_arguments", "append_text",
    "digest_file",
    "folder", "hold_signals", "is_written", "list_changed_tables", "list_differences",
    "lock_folder", "make_manifest", "note_interrupts", "note_signals", "open_run", "open_seal",
    "open_unlinked", "place_run", "raise_on_signals", "read_object", "record_provenance",
    "refuse_format", "refuse_links", "refuse_writing", "replace_file", "seal_file", "seal_record",
    "sync_folder", "time_step", "write_csv", "write_pvd", "write_result", "write_whole",
]  # fmt: skip
