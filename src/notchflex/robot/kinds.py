"""Parts that come in several kinds, and how a new kind is found.

A kind is one class in one file of `notches/`, `materials/` or `friction/`, named after the kind.
The folders are scanned, so that a new file is all that a new kind needs: reading, writing, the
JSON Schema and `--set` pick it up.
"""

import dataclasses
import datetime
import functools
import math
import unicodedata
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, TypeAlias, Union

from pydantic import AfterValidator, BeforeValidator, Field
from pydantic_core import PydanticCustomError

from notchflex._imports import import_all
from notchflex.robot.cuts import CutLayout, Opening
from notchflex.robot.part import (
    MOST_STRAIN,
    Float,
    FloatOrInf,
    Int,
    Problems,
    kind_of,
    part,
    positive,
    quantity,
    unchecked,
)

# The tube that the notches are cut into.


@part
class Tube:
    """A straight round tube before it is cut.

    Args:
        outer_diameter: Outer diameter [mm].
        inner_diameter: Inner diameter [mm], less than the outer one.
        base_length: Uncut length between the held end and the first notch [mm].

    Raises:
        InputError: A value is negative or not finite, or the tube has no wall.

    Example:
        >>> Tube(1.62, 1.40).outer_radius
        0.81
    """

    outer_diameter: Annotated[Float, positive("mm", "outer diameter of the tube", usual=(0.1, 50))]
    inner_diameter: Annotated[Float, positive("mm", "inner diameter of the tube", usual=(0.05, 50))]
    base_length: Annotated[
        Float, quantity("mm", "uncut length before the first notch", at_least=0)
    ] = 0.0

    def conflicts(self) -> Problems:
        """Find a tube without a wall."""
        if self.inner_diameter >= self.outer_diameter:
            yield (
                "inner_diameter",
                f"is {self.inner_diameter} mm; it must be less than the outer diameter, "
                f"{self.outer_diameter} mm.",
            )

    @property
    def outer_radius(self) -> float:
        """Half the outer diameter [mm]."""
        return self.outer_diameter / 2

    @property
    def inner_radius(self) -> float:
        """Half the inner diameter [mm]."""
        return self.inner_diameter / 2


# A tendon that runs along the tube and ends in one of its bodies.


@part
class Tendon:
    """A tendon parallel to the tube axis, pulled at the base.

    Args:
        radius: Distance of the tendon from the tube axis [mm], at most the outer radius.
        direction_deg: Side of the tube on which it runs [deg]; 0 is the side toward which a notch
            of direction 0 bends, counted about the tube axis from the base x axis to y.
        end_body: Body in which it ends, 1 after the first notch ... n after the last;
            None is the last body.
        axial_stiffness: E A of the tendon [N]; infinite is an inextensible tendon.
        path: How it crosses a notch: "wall-arc" lies on the concentric arc of the wall
            (Pacheco 2021, eq. 3), "straight" is the chord between the edges.  Two more readings of
            a straight tendon pull on the body beyond a gap not along that chord but parallel to
            the channel of the body before the gap ("straight-dead") or of the body beyond it
            ("straight-follower"); Liu 2022 leaves the choice open.
        free_length: Length between the drive and the base [mm]; counts for stretch only.
        diameter: Its diameter [mm]; None is not known. It changes no result: a tendon that would
            cross the inner or outer surface of the tube is refused.
        disk_radius: Over gaps of kind "rod", its distance from the axis in the middle of every
            disk [mm], from body 1 to its end; None is `radius`, which then is that in the base.
        disk_direction_deg: Its side there [deg]; None is `direction_deg`. The holes of the disks
            point along the tendon in the straight robot, that of the base along the axis.
        sheath_length: Length of the sheath that leads its wire from the drive to the base [mm];
            None for no sheath. Tensions and strokes are commanded and measured at the drive.
        sheath_friction: Coefficient of friction between wire and sheath; None is 0.
        sheath_bend_deg: Total angle by which the sheath is bent [deg], turns to all sides added;
            None is 0.
        sheath_wire_stiffness: E A of the wire in the sheath [N].
        sheath_stiffness: E A of the sheath under compression [N]; None is rigid.
        backlash: Way of the drive on every reversal before the wire follows [mm]; None is 0.

    Raises:
        InputError: A value is not allowed; or there is one of a sheath and no `sheath_length`.

    Example:
        >>> Tendon(0.70, direction_deg=180.0).path
        'wall-arc'
        >>> Tendon(10.0, path="straight", disk_radius=(8.0, 6.0)).holes
        ((10.0, 8.0, 6.0), (0.0, 0.0, 0.0))
    """

    radius: Annotated[
        Float,
        positive("mm", "distance of the tendon from the tube axis", usual=(0.02, 25)),
    ]
    direction_deg: Annotated[
        Float, quantity("deg", "side of the tube on which the tendon runs")
    ] = 0.0
    end_body: Annotated[
        Int | None,
        Field(ge=1, description="body in which the tendon ends, from 1; left out: the last"),
    ] = None
    axial_stiffness: Annotated[
        FloatOrInf, positive("N", "E A of the tendon; inf is inextensible")
    ] = math.inf
    path: Annotated[
        Literal["wall-arc", "straight", "straight-dead", "straight-follower"],
        Field(
            description='"wall-arc" (along the arc of the wall), "straight" (across the notch), '
            '"straight-dead" or "straight-follower" (across it, the pull parallel to the channel '
            "of the body before or beyond it)"
        ),
    ] = "wall-arc"
    free_length: Annotated[
        Float, quantity("mm", "length between the drive and the base", at_least=0)
    ] = 0.0
    diameter: Annotated[
        Float | None,
        positive("mm", "diameter of the tendon, which must fit the lumen or the wall"),
    ] = None
    disk_radius: Annotated[
        tuple[Annotated[Float, positive("mm", "distance from the axis")], ...] | None,
        Field(
            min_length=1,
            max_length=10_000,
            description="distance from the axis in each disk, from body 1 to the end",
            json_schema_extra={"unit": "mm"},
        ),
    ] = None
    disk_direction_deg: Annotated[
        tuple[Annotated[Float, quantity("deg", "side of the disk")], ...] | None,
        Field(
            min_length=1,
            max_length=10_000,
            description="side in each disk, from body 1 to the end",
            json_schema_extra={"unit": "deg"},
        ),
    ] = None

    @property
    def holes(self) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
        """Radii [mm] and sides [deg] in the base and in every disk; None where all are alike."""
        disks = len(self.disk_radius or self.disk_direction_deg or ())
        radii = self.disk_radius or (self.radius,) * disks
        sides = self.disk_direction_deg or (self.direction_deg,) * disks
        return ((self.radius, *radii), (self.direction_deg, *sides)) if disks else None

    sheath_length: Annotated[
        Float | None,
        positive("mm", "length of the sheath from the drive to the base; left out: none"),
    ] = None
    sheath_friction: Annotated[
        Float | None,
        quantity(
            "", "coefficient of friction of wire in sheath", at_least=0, at_most=10, usual=(0, 0.5)
        ),
    ] = None
    sheath_bend_deg: Annotated[
        Float | None, quantity("deg", "total angle by which the sheath is bent", at_least=0)
    ] = None
    sheath_wire_stiffness: Annotated[
        Float | None, positive("N", "E A of the wire in the sheath")
    ] = None
    sheath_stiffness: Annotated[
        Float | None, positive("N", "E A of the sheath under compression; left out: rigid")
    ] = None
    backlash: Annotated[
        Float | None,
        quantity("mm", "way of the drive on a reversal before the wire follows", at_least=0),
    ] = None

    def without_sheath(self) -> "Tendon":
        """Return the tendon as it is driven at the base."""
        return dataclasses.replace(self, sheath_length=None, **dict.fromkeys(_OF_SHEATH))

    def conflicts(self) -> Problems:
        """Find a sheath without a wire, and values of a sheath that is not there."""
        if self.sheath_length is None:
            for key in _OF_SHEATH:
                if getattr(self, key) is not None:
                    yield key, "needs a sheath; give sheath_length [mm], or leave the key out."
        elif self.sheath_wire_stiffness is None:
            yield (
                "sheath_wire_stiffness",
                "is missing; give E A of the wire in the sheath [N]: a steel wire of 0.3 mm has "
                "14000 N.",
            )


_OF_SHEATH = (
    "sheath_friction",
    "sheath_bend_deg",
    "sheath_wire_stiffness",
    "sheath_stiffness",
    "backlash",
)


@part(kw_only=True)
class Drive:
    """Two tendons on one spool: what it draws of one it releases of the other.

    Args:
        tendon: The tendon that it draws where it turns forward, counted from 1.
        antagonist: The tendon that it releases then.
        pretension: Tension of both drives where it stands at 0 [N].

    Example:
        >>> Drive(tendon=1, antagonist=2, pretension=0.5).antagonist
        2
    """

    tendon: Annotated[Int, Field(ge=1, description="tendon that is drawn forward, from 1")]
    antagonist: Annotated[Int, Field(ge=1, description="tendon that is released then, from 1")]
    pretension: Annotated[Float, positive("N", "tension of both where the spool stands at 0")]


# What parts are cited by.
PACHECO = (
    "Pacheco, Gafford, Atalla, Webster, Fichera: Beyond Constant Curvature: A New Mechanics Model "
    "for Unidirectional Notched-Tube Continuum Wrists. Journal of Medical Robotics Research "
    "6:2140004, 2021, doi:10.1142/s2424905x21400043"
)
LIU = (
    "Liu et al.: Curvature Correction of a Notched Continuum Robot Based on a Static Model "
    "Considering Large Deformation and Friction Effect. Machines 10:778, 2022"
)
GAO = "Gao et al.: IEEE/ASME Transactions on Mechatronics 22:465, 2017 (27-joint manipulator)"
YORK = "York et al.: IEEE International Conference on Robotics and Automation, 2015 (off-axis cuts)"


# How kinds are looked for.

_FOLDERS = {"Notch": "notches", "Material": "materials", "Friction": "friction"}


@functools.cache  # asked for each value that is set by its name
def _import_all(folder: str) -> None:
    import_all(f"notchflex.robot.{folder}", [str(Path(__file__).parent / folder)])


def kinds_of(base: type) -> dict[str, type]:
    """Find every kind of notch, material or friction, by the word that names it."""
    _import_all(_FOLDERS[base.__name__])
    return {kind_of(cls): cls for cls in sorted(base.__subclasses__(), key=kind_of)}


def any_kind_of(base: type) -> Any:
    """Make the type of a field that takes any kind of `base`, selected by its key `kind`."""
    return Annotated[Union[tuple(kinds_of(base).values())], Field(discriminator="kind")]  # noqa: UP007


@part(kw_only=True)
class Material:
    """What every kind of material has.

    Args:
        kind: The word that names the kind in a file.
        poisson_ratio: Poisson's ratio, for shear and torsion.
        density: Density [kg/m3], for the weight of the robot; None where it is not needed.
        allowed_strain: Strain beyond which a simulation warns; None never warns.

    Of a class `by_fibres` tells whether its law sums up the fibres of a section.
    """

    papers: ClassVar[tuple[str, ...]] = ()
    by_fibres: ClassVar[bool] = False
    kind: str
    poisson_ratio: Annotated[
        Float,
        quantity("", "Poisson's ratio, for shear and torsion", above=-1, at_most=0.5),
    ] = 0.33
    density: Annotated[
        Float | None, positive("kg/m3", "density, for the weight", usual=(200, 25_000))
    ] = None
    allowed_strain: Annotated[
        Float | None,
        positive("", "strain beyond which a simulation warns", at_most=MOST_STRAIN),
    ] = None


celsius = functools.partial(quantity, "deg C", at_least=-273.15, at_most=200.0)
"""Describes a temperature; one in kelvin is refused."""


@part(kw_only=True)
class Transforming:
    """What a material has whose plateaus move with the temperature.

    Args:
        temperature: Temperature of use [deg C]; None is `reference_temperature`.
        reference_temperature: Temperature at which the stresses of the plateaus were measured
            [deg C]; None where it is not known, and the temperature does not count.
        plateau_slope: Change of their stresses in tension with the temperature [MPa/K]; None is
            6.5 (Confluent), the literature has 3.4 to 7.8.
        austenite_finish: Temperature above which the free material is all austenite [deg C]; below
            it the material is not superelastic, of which a warning tells.
    """

    temperature: Annotated[Float | None, celsius("temperature of use")] = None
    reference_temperature: Annotated[
        Float | None, celsius("temperature at which the plateaus were measured")
    ] = None
    plateau_slope: Annotated[
        Float | None,
        quantity("MPa/K", "change of the plateaus with temperature", at_least=0, at_most=100.0),
    ] = None
    austenite_finish: Annotated[Float | None, celsius("austenite finish temperature")] = None

    @property
    def stress_per_kelvin(self) -> float:
        """Change of the stresses of the plateaus with the temperature [MPa/K]."""
        return 6.5 if self.plateau_slope is None else self.plateau_slope

    @property
    def used_at(self) -> float | None:
        """Temperature of use, that of the measurement where it is not given [deg C]."""
        return self.reference_temperature if self.temperature is None else self.temperature

    @property
    def plateau_shift(self) -> float:
        """By how much the stresses of the plateaus in tension are above those measured [MPa]."""
        if self.temperature is None or self.reference_temperature is None:
            return 0.0
        return self.stress_per_kelvin * (self.temperature - self.reference_temperature)

    @property
    def plateaus(self) -> tuple[float, ...]:
        """Stresses in tension where the plateaus of loading and of unloading begin [MPa]."""
        raise NotImplementedError

    def conflicts(self) -> Problems:
        """Find a temperature without a reference, or one too cold for the lower plateau."""
        if self.temperature is not None and self.reference_temperature is None:
            yield (
                "reference_temperature",
                "is missing beside `temperature`; give the temperature at which the plateaus were "
                "measured.",
            )
        if (lowest := min(self.plateaus)) <= 0.0:
            yield (
                "temperature",
                f"is {self.temperature} deg C, where the lower plateau would be at "
                f"{lowest:.4g} MPa: the material does not spring back there. "
                "It must be warmer; is it in deg C?",
            )


if TYPE_CHECKING:
    AnyMaterial: TypeAlias = Material
else:
    AnyMaterial = any_kind_of(Material)


@part(kw_only=True)
class Notch:
    """What every kind of notch has.

    The methods say where the rigid bodies and the tendons lie; they describe a slot across one
    side of the tube with a rigid piece behind it, and a kind that differs overrides them.

    Args:
        kind: The word that names the kind in a file.
        uncut_length: Uncut length behind the notch, toward the tip [mm].
        direction_deg: Side toward which the notch bends [deg], about the tube axis from x to y.
        precurvature_deg: Angle of the notch when nothing pulls [deg], positive toward the bend.
        stiffness_factor: Factor on its stiffness in all directions, for what the law of the notch
            leaves out.
        repeat: How many equal notches follow one another.
        tube: The tube of this notch and of the rigid piece behind it; None is that of the robot.
        material: Their material; None is that of the robot.
    """

    is_round: ClassVar[bool] = False  # whether it bends to all sides alike
    is_strip: ClassVar[bool] = False  # whether a strip across the tube bends, which its cuts leave
    is_cut: ClassVar[bool] = True  # whether its cuts are known, from which it can be made
    kind: str
    uncut_length: Annotated[
        Float, quantity("mm", "uncut length behind the notch, toward the tip", at_least=0)
    ]
    direction_deg: Annotated[Float, quantity("deg", "side toward which the notch bends")] = 0.0
    precurvature_deg: Annotated[
        Float, quantity("deg", "angle of the notch when nothing pulls", above=-180, below=180)
    ] = 0.0
    stiffness_factor: Annotated[
        Float, positive("", "factor on its stiffness in all directions", usual=(0.5, 2))
    ] = 1.0
    repeat: Annotated[
        Int,
        Field(ge=1, le=10_000, description="how many equal notches follow"),
    ] = 1
    tube: Annotated[Tube | None, Field(description="its own tube, also of the piece behind it")] = (
        None
    )
    material: Annotated[
        AnyMaterial | None,
        Field(description="its own material, also of the piece behind it"),
    ] = None

    @property
    def papers(self) -> tuple[str, ...]:
        """Papers to cite for its model."""
        return ()

    @property
    def stays_in_plane(self) -> bool:
        """Whether forces in its plane of bending move it in that plane alone."""
        return True

    @property
    def has_elastic_ends(self) -> bool:
        """Whether its stiffness depends on the rings or walls beside it."""
        return getattr(self, "ends", "rigid") != "rigid"

    @property
    def has_lips(self) -> bool:
        """Whether it has lips, which meet where it closes."""
        return not self.is_round

    def made_of(self, material: Material) -> Any:
        """Return what its section law follows from, where the robot is of a material."""
        return self.material or material

    def problems(self, tube: Tube) -> Problems:
        """Find what does not fit the tube: pairs of a key and the rest of the sentence."""
        return ()

    def row_problems(self, before: "Notch") -> Problems:
        """Find what does not fit the notch right before this one, toward the base."""
        return ()

    def tendon_problems(self, tendon: Tendon) -> Problems:
        """Find why a tendon that ends behind this notch cannot run over it: keys of the tendon."""
        return ()

    @property
    def mass(self) -> float | None:
        """Mass of the body behind it [g], where that is not a piece of the tube."""
        return None

    @property
    def spine_cut(self) -> tuple[float, bool] | None:
        """Depth [mm] of the cut that leaves the spine, if any; whether its edges are radial."""
        return None

    def expanded(self) -> tuple["Notch", ...]:
        """Return the notches that this one stands for: `repeat` of them, each with `repeat` 1."""
        return (self if self.repeat == 1 else unchecked(self, repeat=1),) * self.repeat

    @classmethod
    def further_on(cls, table: Mapping[str, Any], count: int) -> dict[str, Any]:
        """Return the table of what is left of a row behind `count` notches, `repeat` as it was."""
        return dict(table)

    def spacing(self, following: "Notch | None") -> float:
        """Return the rigid length along the axis up to the next notch, or to the tip [mm]."""
        return self.uncut_length

    def cut_layout(
        self, tube: Tube, before: "Notch | None", after: "Notch | None"
    ) -> CutLayout | None:
        """Return the cuts between its neighbours (None at an end), if they are known."""
        return None

    def openings(self, before: "Notch | None", after: "Notch | None") -> tuple[Opening, ...]:
        """Return the openings through which tendons enter the body behind this notch."""
        return (Opening(None, 0.0, 0.0),)


def openings_along(notches: Sequence[Notch], direction_deg: float) -> Iterator[tuple[int, Opening]]:
    """Yield the bodies that a tendon on one side [deg] enters, from 1, and their openings."""
    neighbours = (None, *notches, None)
    for number, notch in enumerate(notches, start=1):
        for opening in notch.openings(neighbours[number - 1], neighbours[number + 1]):
            if opening.admits(direction_deg):
                yield number, opening


@part(kw_only=True)
class Friction:
    """What every kind of friction has: a name.

    Args:
        kind: The word that names the kind in a file.
    """

    papers: ClassVar[tuple[str, ...]] = ()
    kind: str

    @property
    def turns_with_chord(self) -> bool:
        """Whether a tendon turns with the chord of a strip, not with the body behind it."""
        return False


# The title block of a drawing.


def _as_text(value: object) -> object:
    """Take a date or a number as its text: TOML needs no quotes round `2026-11-26` or `3`."""
    plain = isinstance(value, datetime.date | int) and not isinstance(value, bool)
    return str(value) if plain else value


def _printable(value: str) -> str:
    """Refuse control characters, which files and terminals take for something else."""
    if any(unicodedata.category(letter) == "Cc" for letter in value):
        raise PydanticCustomError("control_character", "control characters are not allowed")
    return value


PRINTABLE = AfterValidator(_printable)
_Entry: TypeAlias = (
    Annotated[str, Field(strict=True, max_length=60), BeforeValidator(_as_text), PRINTABLE] | None
)
"""An entry of a title block."""


@part(kw_only=True)
class Drawing:
    """What the title block of a drawing says; entries that are None stay empty or have a default.

    Args:
        part: Name or number of the part; by default the name of the robot.
        revision: Its revision.
        material: The material, as a workshop orders it; by default the kind of the model.
        finish: The finish of its surface.
        drawn: Who has drawn it.
        date: The date.

    Raises:
        InputError: A value is no text, or has more than 60 letters.

    Example:
        >>> Drawing(part="W-12", revision="B").revision
        'B'
    """

    part: Annotated[_Entry, Field(description="name or number of the part")] = None
    revision: Annotated[_Entry, Field(description="revision")] = None
    material: Annotated[_Entry, Field(description="material, as it is ordered")] = None
    finish: Annotated[_Entry, Field(description="finish of the surface")] = None
    drawn: Annotated[_Entry, Field(description="who has drawn it")] = None
    date: Annotated[_Entry, Field(description="date")] = None
