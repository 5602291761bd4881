"""Every number has a unit, a source and bounds; derived numbers agree with the paper's table."""

from __future__ import annotations

import math

import pytest
from pydantic import ValidationError

from antennate import experiments
from antennate.cli import main
from antennate.errors import ConfigError
from antennate.params.base import Params, meaning
from antennate.params.control import ConditioningParams, ControlParams
from antennate.params.gaits import GaitParams
from antennate.params.scene import PhysicsParams, TunnelParams
from antennate.robots.antenna import AntennaSpec, SensorParams
from antennate.robots.servos import ServoParams
from antennate.robots.spec import RobotSpec

SOURCES = ("paper", "datasheet", "measured", "fitted", "assumed")


def groups() -> list[type[Params]]:
    found = list(Params.__subclasses__())
    for cls in found:
        found.extend(cls.__subclasses__())
    return sorted(found, key=lambda cls: cls.__name__)


def is_group(annotation: object) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, Params)


def fields(cls: type[Params]) -> list[str]:
    return [name for name, f in cls.model_fields.items() if not is_group(f.annotation)]


def numeric(cls: type[Params]) -> dict[str, object]:
    """Defaults of the fields that hold a float or floats."""
    found = {}
    for name in fields(cls):
        default = cls.model_fields[name].default
        sample = default[0] if isinstance(default, tuple) and default else default
        if isinstance(sample, int | float) and not isinstance(sample, bool):
            found[name] = default
    return found


def spoiled(default: object, bad: float) -> object:
    """The default with its numbers replaced by a bad one."""
    return tuple(bad for _ in default) if isinstance(default, tuple) else bad


@pytest.mark.parametrize("cls", groups())
def test_every_field_has_a_meaning_a_unit_and_a_source_of_a_known_kind(cls: type[Params]) -> None:
    for name in fields(cls):
        extra = cls.model_fields[name].json_schema_extra
        assert isinstance(extra, dict), name
        assert str(extra["unit"]).strip(), name
        assert meaning(cls, name, unit=False), name
        kind, _, why = str(extra["source"]).partition(":")
        assert kind in SOURCES, name
        assert why.strip(), name


def test_the_walk_over_all_groups_finds_the_known_ones() -> None:
    assert {AntennaSpec, GaitParams, PhysicsParams, RobotSpec, ControlParams} <= set(groups())
    assert numeric(GaitParams).keys() >= {"frequency", "amplitude"}


@pytest.mark.parametrize("cls", groups())
def test_an_unknown_key_is_refused(cls: type[Params]) -> None:
    with pytest.raises(ValidationError, match="no_such_number"):
        cls.model_validate({"no_such_number": 1.0})


def taken(cls: type[Params], name: str, value: object) -> bool:
    try:
        cls.model_validate({name: value})
    except ValidationError:
        return False
    return True


@pytest.mark.parametrize("cls", groups())
def test_nan_infinity_and_absurdly_negative_numbers_are_refused(cls: type[Params]) -> None:
    bad = (math.nan, math.inf, -math.inf, -1e9)
    spoils = {n: [spoiled(default, b) for b in bad] for n, default in numeric(cls).items()}
    assert [(n, v) for n, values in spoils.items() for v in values if taken(cls, n, v)] == []


def test_numbers_cannot_be_changed_after_they_are_made() -> None:
    with pytest.raises(ValidationError):
        GaitParams().frequency = 0.7  # type: ignore[misc]


@pytest.mark.parametrize("timestep", [1e-300, 0.0, 1.0])
def test_a_physics_step_that_cannot_work_is_refused(timestep: float) -> None:
    with pytest.raises(ConfigError):
        PhysicsParams(timestep=timestep)


def test_spring_stiffness_is_the_papers_table_in_si() -> None:
    springs = AntennaSpec().spring_stiffness()
    expected = [0.01570, 0.00785, 0.00785, 0.00523, 0.00523, 0.00523]
    assert springs == pytest.approx(expected, rel=1e-3)


def test_spring_stiffness_rounds_to_the_papers_table_per_degree() -> None:
    per_degree = [k * 1e3 * math.pi / 180 for k in AntennaSpec().spring_stiffness()]
    assert [round(k, 3) for k in per_degree] == [0.274, 0.137, 0.137, 0.091, 0.091, 0.091]


def test_the_film_adds_its_stiffness_to_covered_hinges_only() -> None:
    sensor = SensorParams(active_length=0.035)  # over two hinges, 20 mm apart
    params = AntennaSpec(sensor=sensor)
    added = [
        h - s for h, s in zip(params.hinge_stiffness(), params.spring_stiffness(), strict=True)
    ]
    film = 0.048e-3 * 180 / math.pi
    assert added == pytest.approx([film, film, 0, 0, 0, 0], abs=1e-12)


@pytest.mark.parametrize(("length", "hinges"), [(0.12, 5), (0.06, 6), (0.24, 3), (0.4, 2)])
def test_the_film_covers_the_hinges_it_reaches(length: float, hinges: int) -> None:
    # 95.3 mm of film over hinges at multiples of a sixth of the antenna's length, the first at zero
    assert AntennaSpec(length=length).sensed_hinges == hinges


def test_the_servo_follows_its_datasheet() -> None:
    servo = ServoParams()
    assert servo.no_load_speed == pytest.approx(6.81, abs=0.005)
    assert servo.damping == pytest.approx(1.7 / 6.81, rel=1e-3)


@pytest.mark.parametrize(("name", "most"), [("scuttle", 63.0), ("hexapod", 10.19)])
def test_a_robot_that_its_legs_cannot_raise_is_refused(name: str, most: float) -> None:
    """Datasheets: 12 legs of 33 mm at 1.7 N·m, 6 of 84 mm at 1.4 N·m; n τ / (g r)."""
    words = RobotSpec.named(name).model_dump(exclude_unset=True)
    assert RobotSpec(**words | {"mass": most}).mass == most
    with pytest.raises(ConfigError, match=r"mass: expected at most .* kg, which the servos"):
        RobotSpec(**words | {"mass": most + 0.02})


def test_a_robot_lighter_than_its_legs_is_refused() -> None:
    with pytest.raises(ConfigError, match="mass must leave more than 10 g a link"):
        RobotSpec(mass=0.305)


def test_calibration_counts_in_the_wrong_order_are_refused() -> None:
    with pytest.raises(ConfigError, match="counts_high must exceed counts_low"):
        ConditioningParams(counts_low=1900.0, counts_high=1899.5)


def test_a_tunnel_needs_one_turn_between_every_two_pieces() -> None:
    with pytest.raises(ConfigError, match="expected 2, found 1"):
        TunnelParams(segments=(1.0, 1.0, 1.0), turns_deg=(90.0,))


def test_the_control_period_is_ten_milliseconds() -> None:
    assert ControlParams().period == pytest.approx(0.01)


def test_the_page_of_parameters_has_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["parameters"]) == 0
    titles = {line[3:] for line in capsys.readouterr().out.splitlines()}
    configs = {experiments.load(name).config.__name__ for name in experiments.names()}
    assert {"TunnelConfig", "CompeteConfig"} <= configs <= titles


def test_the_command_has_all_of_a_commands_own_parameters(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Who reads a terminal has no other page."""
    assert main(["parameters"]) == 0
    said = capsys.readouterr().out
    antenna = said.partition("## AntennaConfig\n")[2].partition("\n## ")[0]
    assert "| name | default | meaning | source |" in antenna
    assert "| `hold_time` | `30` s | time for which the sensor is held bent | assumed: " in antenna
    assert "options.md" not in said
