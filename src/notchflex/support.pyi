from notchflex._extras import install_command as install_command
from notchflex._extras import need as need
from notchflex._load_words import BodyForceOption as BodyForceOption
from notchflex._load_words import TendonCommand as TendonCommand
from notchflex._load_words import Vector as Vector
from notchflex._load_words import load_columns as load_columns
from notchflex._load_words import parse_number as parse_number
from notchflex._load_words import parse_vector as parse_vector
from notchflex._load_words import parse_whole as parse_whole
from notchflex._load_words import read_body_force as read_body_force
from notchflex._load_words import read_command as read_command
from notchflex._quantity import DEGREES as DEGREES
from notchflex._quantity import REGISTERED as REGISTERED
from notchflex._quantity import Quantity as Quantity
from notchflex._quantity import axis_sizes as axis_sizes
from notchflex._replacing import replacing as replacing
from notchflex._replacing import unwritable as unwritable
from notchflex._summary import Displayed as Displayed
from notchflex._summary import Summary as Summary
from notchflex._summary import round_number as round_number
from notchflex._summary import short as short
from notchflex.analysis.geometry import FlexureShape as FlexureShape
from notchflex.loads.load import ExternalLoad as ExternalLoad
from notchflex.loads.load import check_integer as check_integer
from notchflex.loads.load import check_is_robot as check_is_robot
from notchflex.loads.load import check_number as check_number
from notchflex.loads.load import check_pulls as check_pulls
from notchflex.loads.load import short_repr as short_repr
from notchflex.loads.load_path import load_path as load_path
from notchflex.mechanics.chain import unchecked_dimensions as unchecked_dimensions
from notchflex.results.io import frame as frame
from notchflex.results.io import whole_document as whole_document
from notchflex.results.io import write_groups as write_groups
from notchflex.results.io import write_netcdf as write_netcdf
from notchflex.results.io import write_parquet as write_parquet
from notchflex.results.quantities import AXES as AXES
from notchflex.results.quantities import CONTACT_STATES as CONTACT_STATES
from notchflex.results.quantities import QUANTITIES as QUANTITIES
from notchflex.results.quantities import holds as holds
from notchflex.results.quantities import spans_of as spans_of
from notchflex.results.reading import Table as Table
from notchflex.results.reading import no_tendon_column as no_tendon_column
from notchflex.results.reading import read_data_table as read_data_table
from notchflex.results.reading import read_specification as read_specification
from notchflex.results.reading import robot_named as robot_named
from notchflex.results.reading import tendon_columns as tendon_columns
from notchflex.results.reading import validated as validated
from notchflex.results.state import SavedState as SavedState
from notchflex.results.state import robot_digest as robot_digest
from notchflex.results.tables import (
    csv_text as csv_text,
)
from notchflex.results.tables import (
    document_head as document_head,
)
from notchflex.results.tables import (
    entries_of as entries_of,
)
from notchflex.results.tables import (
    is_listed as is_listed,
)
from notchflex.results.tables import (
    plain as plain,
)
from notchflex.results.tables import (
    write_columns as write_columns,
)
from notchflex.results.tables import (
    write_csv as write_csv,
)
from notchflex.results.tables import (
    write_json as write_json,
)
from notchflex.results.tables import (
    write_path_csv as write_path_csv,
)
from notchflex.results.writing import BROWSER as BROWSER
from notchflex.results.writing import MOVING as MOVING
from notchflex.results.writing import PAPER as PAPER
from notchflex.results.writing import STANDARD_OUTPUT as STANDARD_OUTPUT
from notchflex.results.writing import check_distinct as check_distinct
from notchflex.results.writing import check_folder as check_folder
from notchflex.results.writing import check_output as check_output
from notchflex.results.writing import check_picture as check_picture
from notchflex.results.writing import let_go as let_go
from notchflex.results.writing import write_document as write_document
from notchflex.results.writing import write_text as write_text
from notchflex.robot import Friction as Friction
from notchflex.robot import Material as Material
from notchflex.robot import Notch as Notch
from notchflex.robot import from_table as from_table
from notchflex.robot import kinds_of as kinds_of
from notchflex.robot import parse_assignment as parse_assignment
from notchflex.robot import robot_from_text as robot_from_text
from notchflex.robot import robot_text as robot_text
from notchflex.robot import to_table as to_table
from notchflex.robot.cuts import Arc as Arc
from notchflex.robot.cuts import Line as Line
from notchflex.robot.cuts import NotchCut as NotchCut
from notchflex.robot.cuts import Point as Point
from notchflex.robot.cuts import outline as outline
from notchflex.robot.cuts import pieces as pieces
from notchflex.robot.cuts import shrunk as shrunk
from notchflex.robot.part import Float as Float
from notchflex.robot.part import FloatOrInf as FloatOrInf
from notchflex.robot.part import Int as Int
from notchflex.robot.part import ProblemError as ProblemError
from notchflex.robot.part import fields_of as fields_of
from notchflex.robot.part import is_list as is_list
from notchflex.robot.part import is_unsaid as is_unsaid
from notchflex.robot.part import kind_of as kind_of
from notchflex.robot.part import nearest as nearest
from notchflex.robot.part import part as part
from notchflex.robot.part import quantity as quantity
from notchflex.robot.problems import Tolerance as Tolerance
from notchflex.robot.problems import Tolerances as Tolerances
from notchflex.robot.problems import with_limits as with_limits
from notchflex.robot.reading import bounded_bytes as bounded_bytes
from notchflex.robot.reading import load_changed as load_changed
from notchflex.robot.reading import parse_toml as parse_toml
from notchflex.robot.reading import read_text as read_text
from notchflex.robot.robot import remember_source as remember_source
from notchflex.robot.robot import schema_of as schema_of
from notchflex.robot.robot import source_of as source_of
from notchflex.robot.value_names import described_at as described_at
from notchflex.robot.value_names import number_at as number_at
from notchflex.robot.value_names import numbers_at as numbers_at
from notchflex.solver.programs.compiled import number_of_cores as number_of_cores
from notchflex.solver.programs.compiled import on_cores as on_cores
