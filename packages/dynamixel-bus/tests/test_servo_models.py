"""A servo model of one's own is one file given by its path; and files that are refused."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from test_control_tables import plain

import dynamixel_bus
from dynamixel_bus import packets
from dynamixel_bus.command import main
from dynamixel_bus.errors import ConfigError
from dynamixel_bus.models import MODELS, model_name, servo_model
from dynamixel_bus.packets import StatusError
from dynamixel_bus.parser import Parser
from dynamixel_bus.servo_bus import ServoBus
from dynamixel_bus.servo_list import make_servo, read_list

XM430_W210 = """
like = "xc430-w240"
without = ["present_load"]
name = "XM430-W210-T"
number = 1030
source = "https://emanual.robotis.com/docs/en/dxl/x/xm430-w210/"
modes = [0, 1, 3, 4, 5, 16]

[rating]
stall_current = { value = 2.3, source = "for this test" }

[registers]
min_voltage_limit = { default = 95, range = [95, 160] }
current_limit = { address = 38, size = 2, access = "RW", unit = "2.69 mA", default = 1193 }
goal_current = { address = 102, size = 2, access = "RW", unit = "2.69 mA", signed = true }
present_current = { address = 126, size = 2, access = "R", unit = "2.69 mA", signed = true }
"""


def test_a_model_of_ones_own_is_one_file(tmp_path: Path) -> None:
    """It answers a ping as its model, and takes and tells currents in its own unit."""
    path = tmp_path / "xm430-w210.toml"
    path.write_text(XM430_W210)
    servo = make_servo(*read_list([f"7:{path}"]))
    wire = ServoBus([servo])
    wire.receive(0.0, packets.ping(7))
    (said,) = Parser().feed(wire.transmit(1.0))
    assert int.from_bytes(said.params[1:3], "little") == 1030
    assert servo.write(11, b"\0") == StatusError.NONE  # current mode
    assert servo.write(102, (1194).to_bytes(2, "little")) == StatusError.DATA_LIMIT
    assert servo.write(102, (600).to_bytes(2, "little")) == StatusError.NONE
    assert servo.write(64, b"\1") == StatusError.NONE
    servo.advance(0.01)
    friction = 0.1 * 2.3  # a tenth of the stall torque, docs/twin.md
    assert servo.get("present_current") == pytest.approx(600 - friction / 2.69e-3, abs=5)


def test_its_table_is_that_of_the_official_sdk(tmp_path: Path) -> None:
    path = tmp_path / "xm430-w210.toml"
    path.write_text(XM430_W210)
    easy = pytest.importorskip("dynamixel_easy_sdk")
    official = Path(easy.__file__).parent / "control_table" / "xm430_w210.model"
    rows = official.read_text().partition("[control table]")[2].splitlines()[2:]
    for address, size, title in (row.split("\t")[:3] for row in rows if row.strip()):
        if not title.startswith("Indirect"):
            register = servo_model(path)[plain(title)]
            assert (register.address, register.size) == (int(address), int(size))


@pytest.mark.parametrize("name", MODELS)
def test_each_number_of_a_rating_has_a_source(name: str) -> None:
    sources = servo_model(name).rating.sources
    assert len(sources) == 9
    assert all(
        s.split(":")[0] in ("datasheet", "measured", "fitted", "assumed") for s in sources.values()
    )
    assert servo_model(name).source.startswith("https://emanual.robotis.com/docs/en/dxl/x/")
    assert model_name(servo_model(name).number) == servo_model(name).name


WRONG = [
    ('like = "xc430-w240"', 'like = "xm430"', "like: expected one of xc330-m181, xc330-m288"),
    ('like = "xc430-w240"', 'like = "xm430-w210.toml"', "found one like itself"),
    ('like = "xc430-w240"', "", "expected the key firmware"),
    ("number = 1030", "numbers = 1030", "unknown key 'numbers' (did you mean number?)"),
    ("number = 1030", 'number = "1030"', "number: expected a whole number, found '1030'"),
    ('["present_load"]', '["present_lode"]', "without: expected a register of xc430-w240"),
    ('["present_load"]', "[]", "registers.present_current: overlaps present_load"),
    (
        "[registers]",
        '[registers]\npresent_position = { unit = "1 deg" }',
        "expected '1 pulse', as all",
    ),
    ('"2.69 mA", signed = true }\np', '"1 mA", signed = true }\np', "expected one unit"),
    ('size = 2, access = "R"', 'size = 3, access = "R"', "a size of 1, 2 or 4"),
    ('access = "R",', 'access = "W",', "access: expected R or RW, found 'W'"),
    ("range = [95, 160]", "range = [160, 95]", "range: expected the least and the largest value"),
    ("default = 1193", "default = 70000", "expected unsigned values of 2 bytes, found 70000"),
    ("min_voltage_limit = {", "min_voltage_limit = { address = 40,", "expected 34, as all servos"),
    ("value = 2.3", 'value = "2.3"', "stall_current: value: expected a number from 1e-06 to 100"),
    ("value = 2.3", "value = nan", "expected a number from 1e-06 to 100, found nan"),
    ("value = 2.3", "value = 99", "expected one that two bytes can tell"),
    ("modes = [0, 1, 3, 4, 5, 16]", "modes = [[0], 3]", "modes: expected some of"),
    ("modes = [0, 1, 3, 4, 5, 16]", "modes = [0, 1]", "operating_mode: expected one of its modes"),
    ("[registers]", "[registers]\nbaud_rate = { range = [0, 9] }", "a range within 0 to 7"),
    ("[registers]", "[registers]\nindirect_data_1 = {}", "expected the key address, found none"),
    ("default = 95", "default = 94", "default: expected 95 to 160, found 94"),
    ("current_limit = {", "current_limits = {", "expected the register current_limit, found none"),
    ("number = 1030", "number = 70000", "number: expected 0 to 65535, found 70000"),
    ("[rating]", "[[indirect]]\ncount = 1\n[rating]", "expected the key first, found none"),
    ('["present_load"]', "[[1]]", "a list of names as `without`"),
    ("value = 2.3", 'value = 2.3, unit = "mA"', "unit: expected A, found 'mA'"),
    ("[registers]", "[registers", "expected TOML"),
]


@pytest.mark.parametrize(("old", "new", "said"), WRONG)
def test_a_file_that_is_no_model_is_refused_and_says_why(
    old: str, new: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "xm430-w210.toml"
    assert old in XM430_W210
    path.write_text(XM430_W210.replace(old, new, 1))
    with pytest.raises(ConfigError) as caught:
        servo_model(path)
    assert str(path) in str(caught.value)
    assert said in str(caught.value)
    assert main([f"1:{path}"]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert said in err


def test_a_model_that_is_not_there_is_refused_with_the_nearest_name() -> None:
    with pytest.raises(ConfigError, match="found xl430-w25"):
        servo_model("xl430-w25")
    with pytest.raises(ConfigError, match="expected a readable file"):
        servo_model("no-such-servo.toml")


@pytest.mark.ci
def test_models_are_read_from_a_zip(tmp_path: Path) -> None:
    """Python imports packages from a zip, as a program of one file brings them."""
    folder, place = Path(dynamixel_bus.__file__).parent, tmp_path / "program.zip"
    with zipfile.ZipFile(place, "w") as file:
        for part in (each for kind in ("py", "toml") for each in folder.rglob(f"*.{kind}")):
            file.write(part, part.relative_to(folder.parent))
    (tmp_path / "own.toml").write_text(XM430_W210)
    code = "import sys; sys.path.insert(0, 'program.zip'); from dynamixel_bus import models as m; "
    code += "print(m.__file__, m.XL330_M288.number, m.servo_model('own.toml').number)"
    ran = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert ran.stderr == ""
    where, *numbers = ran.stdout.split()
    assert "program.zip" in where
    assert numbers == ["1200", "1030"]


@pytest.mark.parametrize("name", ["xl320", "XL-320"])
def test_the_xl320_is_refused_with_the_reason(name: str) -> None:
    """It speaks Protocol 2.0, and its Goal Position lies at 30 (its manual), not at 116."""
    with pytest.raises(ConfigError, match=f"found {name}: .*goal position at 30, not 116"):
        servo_model(name)


def test_the_command_refuses_the_xl320_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["1:xl320"]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert "found xl320: the XL-320 has another control table" in err
