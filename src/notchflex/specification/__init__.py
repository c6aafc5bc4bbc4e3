"""Which quantity, under which load, which entry, within which limits: in files, Python and words.

`records.py` has the records that the specifications of designs, tolerances, sweeps and workspaces
share, `entries.py` what they mean in a result, `loads.py` loads of files, `reading.py` errors.
"""

from notchflex.specification.entries import (
    Criterion,
    chosen_entries,
    entry_names,
    known_numbers,
    limited_numbers,
    load_named,
)
from notchflex.specification.loads import LOAD_KEYS, LoadTables, read_load
from notchflex.specification.reading import (
    OldWords,
    coded,
    known,
    made,
    placed,
    record,
    whole,
    with_robot,
)
from notchflex.specification.records import (
    Between,
    LimitedQuantity,
    Measured,
    Varied,
    as_list,
    check_percent,
    check_quantity,
)

__all__ = [
    "LOAD_KEYS",
    "Between",
    "Criterion",
    "LimitedQuantity",
    "LoadTables",
    "Measured",
    "OldWords",
    "Varied",
    "as_list",
    "check_percent",
    "check_quantity",
    "chosen_entries",
    "coded",
    "entry_names",
    "known",
    "known_numbers",
    "limited_numbers",
    "load_named",
    "made",
    "placed",
    "read_load",
    "record",
    "whole",
    "with_robot",
]
