"""Files that are read and written: dumps, windows, states, settlement tables, run folders."""

from adapters.files import restart
from adapters.files.dump import Frame, Kind, write_dump
from adapters.files.dump_reader import read_frames
from adapters.files.full_disk import explain_full_disk
from adapters.files.load_series import LoadSeries, read_load_series
from adapters.files.run_folder import COLUMNS, EVENTS, EXCHANGE, Outcome, RunFolder, place_stage
from adapters.files.series import make_too_few_error, read_series
from adapters.files.settlement_table import UNKNOWN, Series
from adapters.files.states import check_state_name, read_state_file, write_state_file
from adapters.files.window import Window, load_window, read_state, read_window, save_window

__all__ = [
    "COLUMNS", "EVENTS", "EXCHANGE", "UNKNOWN", "Frame", "Kind", "LoadSeries", "Outcome",
    "RunFolder", "Series", "Window", "check_state_name", "explain_full_disk", "load_window",
    "make_too_few_error", "place_stage", "read_frames", "read_load_series", "read_series",
    "read_state", "read_state_file", "read_window", "restart", "save_window", "write_dump",
    "write_state_file",
]  # fmt: skip
