"""The JSON Schema of robot files."""

import pytest

import notchflex as nf
from notchflex.robot.kinds import Friction, Material, Notch, kinds_of


def test_what_a_file_must_hold():
    schema = nf.json_schema()
    assert schema["required"] == ["name", "tube", "notch", "tendon", "material", "friction"]
    assert schema["additionalProperties"] is False
    arc = schema["$defs"]["ArcNotch"]
    assert arc["required"] == ["kind", "cut", "depth", "height", "uncut_length"]
    assert arc["additionalProperties"] is False
    assert arc["properties"]["cut"]["enum"] == ["on-axis", "off-axis"]
    assert arc["properties"]["depth"]["exclusiveMinimum"] == 0
    assert arc["properties"]["depth"]["unit"] == "mm"
    assert arc["properties"]["repeat"]["minimum"] == 1
    strip = schema["$defs"]["StripNotch"]
    assert strip["required"] == ["kind", "height", "strip_thickness", "depth"]
    assert "default" not in strip["properties"]["strip_length"]
    assert strip["properties"]["strip_length"]["exclusiveMinimum"] == 0
    link = schema["$defs"]["ULink"]
    assert link["properties"]["proximal_slot"]["enum"] == ["away", "toward"]
    assert link["properties"]["uncut_length"]["default"] == 0.0
    assert "default" not in schema["$defs"]["Tendon"]["properties"]["axial_stiffness"]
    assert schema["properties"]["notch"]["minItems"] == 1


def test_every_key_says_what_it_is():
    schema = nf.json_schema()
    for model in schema["$defs"].values():
        assert model["description"]
        for key, value in model["properties"].items():
            assert key == "kind" or value["description"], key
            if "$ref" not in value and "oneOf" not in value:  # parts
                assert value["type"] in ("number", "integer", "string", "array")


@pytest.mark.parametrize("base", [Notch, Material, Friction])
def test_every_kind_is_in_it(base: type):
    defs = nf.json_schema()["$defs"]
    assert kinds_of(base)
    for kind, cls in kinds_of(base).items():
        assert defs[cls.__name__]["properties"]["kind"]["const"] == kind
        # found by its file, which is named after it
        assert cls.__module__.rpartition(".")[2] == kind.replace("-", "_")
