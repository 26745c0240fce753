from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from urdyn.errors import InputError, RtdeError
from urdyn.io.rtde.fields import TYPES, inputs, outputs
from urdyn.io.rtde.recipe import DEFAULT, Recipe, channels
from urdyn.io.rtde.recipe_file import read_recipe

ONE_OF_EACH = Recipe(tuple(f"a_{type_}" for type_ in TYPES), tuple(TYPES), 500.0, 1)
VALUES = {
    "a_BOOL": True,
    "a_UINT8": 255,
    "a_UINT32": 2**32 - 1,
    "a_UINT64": 2**64 - 1,
    "a_INT32": -(2**31),
    "a_DOUBLE": np.pi,
    "a_VECTOR3D": np.array([1.0, np.nan, -np.inf]),
    "a_VECTOR6D": np.linspace(0, 1, 6),
    "a_VECTOR6INT32": np.array([253, -1, 0, 1, 2, 3]),
    "a_VECTOR6UINT32": [0, 1, 2, 3, 4, 2**32 - 1],
}


def test_a_package_holds_what_was_put_in() -> None:
    got = ONE_OF_EACH.unpack(ONE_OF_EACH.pack(VALUES))
    for name, value in VALUES.items():
        np.testing.assert_array_equal(got[name], value)
    assert ONE_OF_EACH.size == 1 + 1 + 4 + 8 + 4 + 8 + 24 + 48 + 24 + 24


def test_numbers_are_in_network_byte_order() -> None:
    recipe = Recipe(("robot_mode", "timestamp"), ("INT32", "DOUBLE"))
    assert recipe.pack({"robot_mode": 7, "timestamp": 1.0}) == b"\0\0\0\x07\x3f\xf0" + bytes(6)


def test_what_nobody_said_is_zero() -> None:
    assert ONE_OF_EACH.pack({}) == bytes(ONE_OF_EACH.size)


@pytest.mark.parametrize("value", [[1.0, 2.0], "text", None, 2**40])
def test_a_value_that_does_not_fit_is_named(value: object) -> None:
    with pytest.raises(RtdeError, match="joint_mode"):
        Recipe(("joint_mode",), ("VECTOR6INT32",)).pack({"joint_mode": value})


def test_packages_become_channels_of_a_log() -> None:
    recipe = Recipe(("timestamp", "actual_q"), ("DOUBLE", "VECTOR6D"))
    packages = b"".join(
        recipe.pack({"timestamp": k / 500, "actual_q": np.full(6, k)}) for k in range(4)
    )
    made = channels(recipe.rows(packages))
    assert made["timestamp"].shape == (4,) and made["actual_q"].shape == (4, 6)
    assert made["actual_q"].dtype == np.float64 and made["actual_q"][3, 5] == 3


def test_releases_know_what_the_guide_says() -> None:
    assert "ft_raw_wrench" not in outputs((3, 15, 8, 0)) and "ft_raw_wrench" in outputs((5, 9))
    assert "payload" not in outputs((5, 3, 0, 0)) and "payload" in outputs((5, 5, 1, 0))
    assert "actual_current_as_torque" in outputs((10, 12, 0, 0))
    assert "output_bit_register_63" not in outputs((5, 23)) and len(inputs((5, 23))) > 170
    for release in ((3, 15, 8, 0), (5, 23, 0, 0), (10, 12, 0, 0)):
        assert outputs(release).keys() >= set(DEFAULT)
        assert TYPES.keys() >= {*outputs(release).values(), *inputs(release).values()}


XML = """<?xml version="1.0"?>
<rtde_config>
  <recipe key="state"><field name="speed_scaling" type="DOUBLE"/></recipe>
  <recipe key="out">
    <field name="timestamp" type="DOUBLE"/>
    <field name="actual_q" type="VECTOR6D"/>
  </recipe>
</rtde_config>
"""


def test_recipes_are_read_as_xml_and_as_lists(tmp_path: Path) -> None:
    (tmp_path / "ur.xml").write_text(XML)
    (tmp_path / "list.txt").write_text("timestamp, actual_q  # the pose\n\n# no more\nactual_q\n")
    assert read_recipe(tmp_path / "ur.xml") == ("timestamp", "actual_q")
    assert read_recipe(tmp_path / "ur.xml", "state") == ("speed_scaling",)
    assert read_recipe(tmp_path / "list.txt") == ("timestamp", "actual_q")


@pytest.mark.parametrize("text", [XML, "timestamp\nactual_q  # Pose für Zelle 7, 20 °C\n"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1"])
def test_a_recipe_may_be_of_any_editor(tmp_path: Path, text: str, encoding: str) -> None:
    (tmp_path / "recipe").write_text(text, encoding=encoding)
    assert read_recipe(tmp_path / "recipe") == ("timestamp", "actual_q")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('<!DOCTYPE a [<!ENTITY b "c">]>' + XML.partition("\n")[2], "DOCTYPE"),
        (XML.replace("</recipe>", ""), "not XML"),
        (XML.replace("VECTOR6D", "VECTOR7D"), "VECTOR7D"),
        (XML.replace('name="actual_q"', ""), "without a name"),
        (XML.replace('"out"', '"in"'), "has no recipe 'out', but 'state', 'in'$"),
        ('<rtde_config><recipe key="out"/></rtde_config>', "names no variable"),
        ("", "names no variable"),
        ("actuäl_q", "neither"),
    ],
)
def test_a_recipe_that_is_none_says_why(tmp_path: Path, text: str, told: str) -> None:
    (tmp_path / "recipe").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=told):
        read_recipe(tmp_path / "recipe")


def test_a_recipe_that_is_not_there_says_so(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_recipe(tmp_path / "none.xml")
