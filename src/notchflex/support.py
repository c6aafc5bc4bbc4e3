"""What a package built on notchflex may use besides the names of `notchflex`; all else may change.

Errors and checks, summaries, loads in words, files replaced whole, tables and documents, robots as
tables and the names of their values, the registry of quantities, slopes along any changes of what a
path is computed from.  Names are loaded when first used.
"""

from notchflex._imports import loader

_HOME = {
    name: home
    for home, names in {
        "notchflex._imports": (
            "install_command",
            "need",
        ),
        "notchflex._load_words": (
            "BodyForceOption",
            "TendonCommand",
            "Vector",
            "load_columns",
            "parse_spec",
            "parse_number",
            "parse_vector",
            "parse_whole",
            "read_body_force",
            "read_command",
        ),
        "notchflex._quantity": (
            "DEGREES",
            "Quantity",
            "REGISTERED",
            "axis_sizes",
        ),
        "notchflex._replacing": (
            "AnyPath",
            "check_is_path",
            "replacing",
            "unwritable",
        ),
        "notchflex._summary": (
            "Displayed",
            "Summary",
            "round_number",
            "short",
        ),
        "notchflex.analysis.draws": (
            "ToleranceSource",
            "deviation",
            "moments",
            "sources_of",
            "tolerances_of",
            "values_at",
        ),
        "notchflex.analysis.geometry": ("FlexureShape",),
        "notchflex.analysis.slopes": ("changes", "derivatives", "load_change"),
        "notchflex.analysis.tangent": ("Change",),
        "notchflex.loads.command": ("check_external",),
        "notchflex.loads.load": (
            "ExternalLoad",
            "check_integer",
            "check_is_robot",
            "check_number",
            "check_pulls",
            "short_repr",
        ),
        "notchflex.loads.load_path": ("load_path",),
        "notchflex.mechanics.chain": ("law_errors", "limit_line", "unchecked_dimensions"),
        "notchflex.mechanics.material": ("CORNERS", "PLACES", "SectionStrain", "edge_strain"),
        "notchflex.results.io": (
            "frame",
            "whole_document",
            "write_groups",
            "write_netcdf",
            "write_parquet",
        ),
        "notchflex.results.quantities": (
            "AXES",
            "CONTACT_STATES",
            "QUANTITIES",
            "entries_there",
            "holds",
            "spans_of",
        ),
        "notchflex.results.reading": (
            "Table",
            "no_tendon_column",
            "read_data_table",
            "read_specification",
            "robot_named",
            "tendon_columns",
            "validated",
        ),
        "notchflex.results.state": ("robot_digest",),
        "notchflex.results.tables": (
            "csv_text",
            "document_head",
            "entries_of",
            "is_listed",
            "plain",
            "write_columns",
            "write_csv",
            "write_json",
            "write_path_csv",
        ),
        "notchflex.results.writing": (
            "BROWSER",
            "MOVING",
            "PAPER",
            "STANDARD_OUTPUT",
            "check_distinct",
            "check_folder",
            "check_output",
            "check_picture",
            "let_go",
            "write_document",
            "write_text",
        ),
        "notchflex.robot": (
            "Friction",
            "Material",
            "Notch",
            "from_table",
            "kinds_of",
            "parse_assignment",
            "robot_from_text",
            "robot_text",
            "to_table",
        ),
        "notchflex.robot.cuts": (
            "Arc",
            "Line",
            "NotchCut",
            "Point",
            "outline",
            "pieces",
            "shrunk",
        ),
        "notchflex.robot.part": (
            "Float",
            "FloatOrInf",
            "Int",
            "ProblemError",
            "fields_of",
            "is_list",
            "is_unsaid",
            "kind_of",
            "nearest",
            "part",
            "quantity",
        ),
        "notchflex.robot.problems": (
            "Tolerance",
            "Tolerances",
            "with_limits",
        ),
        "notchflex.robot.files": (
            "bounded_bytes",
            "read_text",
        ),
        "notchflex.robot.reading": (
            "load_changed",
            "parse_toml",
        ),
        "notchflex.robot.robot": (
            "remember_source",
            "schema_of",
            "source_of",
        ),
        "notchflex.robot.value_names": (
            "described_at",
            "number_at",
            "numbers_at",
        ),
        "notchflex.solver.programs.compiled": (
            "backend",
            "number_of_cores",
            "on_cores",
        ),
    }.items()
    for name in names
}

__all__ = [*sorted(_HOME)]  # pyright: ignore[reportUnsupportedDunderAll]

__getattr__ = loader(__name__, _HOME)
