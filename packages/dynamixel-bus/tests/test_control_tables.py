"""Every register of twelve models in bytes: address, size, access, initial value and range.

The expected values are those of the manual's pages, copied in `manual_tables.py`. What a register
does is in `test_control_effects.py`.
"""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from manual_tables import ALL_PAGES, RATINGS, SIZE_330, Page, Row
from servo_bench import ACCESS, LENGTH, LIMIT, NONE, RANGE, Bench

from dynamixel_bus.models import MODELS_BY_NUMBER


def write(page: Page, row: Row, value: int, size: int | None = None) -> int:
    """Write to a new servo; the number of the error."""
    data = value.to_bytes(size or row.size, "little", signed=value < 0)
    (said,) = Bench(page).ask(3, row.address.to_bytes(2, "little") + data)
    return said.error


@pytest.mark.parametrize("page", ALL_PAGES, ids=lambda page: page.name)
def test_our_table_has_the_registers_of_the_manual_and_no_others(page: Page) -> None:
    table = MODELS_BY_NUMBER[page.model]
    assert table.name == page.name
    assert table.modes == page.modes
    ours = {r.address: (r.name, r.size, r.signed, r.writable) for r in table.registers.values()}
    theirs = {r.address: (r.name, r.size, r.signed, r.writable) for r in page.rows.values()}
    assert ours == theirs


@pytest.mark.parametrize("page", ALL_PAGES, ids=lambda page: page.name)
def test_a_register_can_be_read_at_its_address_and_has_its_initial_value(page: Page) -> None:
    bench = Bench(page)
    for row in page.rows.values():
        if row.initial is not None:
            assert bench.get(row.name) == row.initial, row.name


@pytest.mark.parametrize("page", ALL_PAGES, ids=lambda page: page.name)
def test_what_the_page_does_not_list_cannot_be_read(page: Page) -> None:
    listed = {a for row in page.rows.values() for a in range(row.address, row.address + row.size)}
    bench = Bench(page)
    for address in range(max(listed) + 10):
        error, data = bench.servo.read(address, 1)
        assert (error, len(data)) == ((NONE, 1) if address in listed else (ACCESS, 0)), address


@pytest.mark.parametrize("page", ALL_PAGES, ids=lambda page: page.name)
def test_what_can_only_be_read_is_not_written_and_half_of_a_register_neither(page: Page) -> None:
    for row in page.rows.values():
        if not row.writable:
            assert write(page, row, 0) == ACCESS, row.name
        elif row.size > 1:
            assert write(page, row, 0, size=row.size // 2) == LENGTH, row.name


def bounds(page: Page, row: Row) -> dict[int, int]:
    """The error of each value at and beyond the ends of a range; none where the page has no range.

    Where it gives a rule, see the effects.
    """
    if row.low in "-?":
        return {}
    if row.low[0] == "~":
        most = page.row(row.low[1:]).initial
        assert most is not None
        return {most: NONE, most + 1: LIMIT} | (
            {-most: NONE, -most - 1: LIMIT} if row.signed else {}
        )
    low, high = int(row.low), int(row.high)
    found = {low: NONE, high: NONE}
    if row.signed or low:
        found[low - 1] = RANGE
    room = 8 * row.size - row.signed
    if high < 2**room - 1 and row.name != "secondary_id":  # 253 to 255 turn that one off
        found[high + 1] = RANGE
    return found


@pytest.mark.parametrize("page", ALL_PAGES, ids=lambda page: page.name)
def test_the_ends_of_its_range_can_be_written_and_nothing_beyond(page: Page) -> None:
    known = 0
    for row in page.rows.values():
        for value, error in bounds(page, row).items() if row.writable else ():
            assert write(page, row, value) == error, (row.name, value)
            known += 1
    assert known > 50


@pytest.mark.parametrize("page", ALL_PAGES, ids=lambda page: page.name)
def test_a_mode_that_the_model_lacks_is_refused(page: Page) -> None:
    row = page.row("operating_mode")
    for mode in range(256):
        assert write(page, row, mode) == (NONE if mode in page.modes else RANGE), mode


@pytest.mark.parametrize("page", ALL_PAGES, ids=lambda page: page.name)
def test_bits_of_drive_mode_that_are_unused_stay_0(page: Page) -> None:
    row = page.row("drive_mode")
    used = {0, 1, 4, 5} if page.name.startswith("XL330") else {0, 1, 4, 5, 8, 9, 12, 13}
    for bits in range(16):
        assert write(page, row, bits) == (NONE if bits in used else RANGE), bits


@pytest.mark.parametrize("page", ALL_PAGES, ids=lambda page: page.name)
def test_protocols_that_the_page_lists_are_taken(page: Page) -> None:
    row = page.row("protocol_type")
    known = {2, 20, 21, 22} if page.model in SIZE_330 else {1, 2}
    for kind in range(30):
        assert write(page, row, kind) == (NONE if kind in known else RANGE), kind


@pytest.mark.parametrize("page", ALL_PAGES, ids=lambda page: page.name)
def test_torque_locks_the_eeprom_and_nothing_else(page: Page) -> None:
    for row in page.rows.values():
        if not row.writable or row.name == "torque_enable":
            continue
        bench = Bench(page)
        value = bench.get(row.name)
        assert bench.put("torque_enable", 1) == NONE
        assert bench.put(row.name, value) == (ACCESS if row.address < 64 else NONE), row.name


MODEL_FILES = {page.model: page.name[:-2].lower().replace("-", "_") for page in ALL_PAGES}
"""Files of the official SDK by model number."""
NOT_IN_FILES = {"startup_configuration", "backup_ready"}
"""Registers of the manual that no file of the SDK has."""
OTHER_NAMES = {"secondary_shadow_id": "secondary_id"}


def rows_of_the_sdk(model: int, firmware: int) -> dict[int, tuple[int, str]]:
    """Size and name by address, as a file of the SDK lists them.

    Which file is for a firmware says
    https://github.com/ROBOTIS-GIT/dynamixel_hardware_interface/pull/69: the newest `_fwNN` that is
    no newer than it, else the one without.
    """
    easy = pytest.importorskip("dynamixel_easy_sdk")
    name = MODEL_FILES[model]
    files = {
        int(path.stem.partition("_fw")[2] or 0): path
        for path in (Path(easy.__file__).parent / "control_table").glob(f"{name}*.model")
        if path.stem.partition("_fw")[0] == name
    }
    if model in SIZE_330 and 52 not in files:
        pytest.skip("this release of the SDK has no table for firmware 52")
    lines = files[max(v for v in files if v <= firmware)].read_text().partition("[control table]")
    rows = (line.split("\t") for line in lines[2].split("\n")[2:] if line.strip())
    return {int(address): (int(size), title.strip()) for address, size, title, *_ in rows}


def plain(title: str) -> str:
    """A title as a name of the manual."""
    words = "".join(c if c.isalnum() else " " for c in title.lower()).split()
    name = "_".join(words)
    return OTHER_NAMES.get(name, name)


@pytest.mark.parametrize("page", ALL_PAGES, ids=lambda page: page.name)
def test_the_table_is_that_of_the_official_sdk_for_the_firmware_that_a_servo_says(
    page: Page,
) -> None:
    """All addresses, and the way of ROBOTIS's driver: positions through its indirect data."""
    bench = Bench(page)
    (pinged,) = bench.ask(1)
    theirs = rows_of_the_sdk(page.model, pinged.data[2])
    ours = {row.address: row for row in MODELS_BY_NUMBER[page.model].registers.values()}
    assert len(theirs) > 50
    for address, (size, title) in theirs.items():
        assert address in ours, title
        assert ours[address].size == size, title
        if not title.startswith("Indirect"):  # theirs name the first byte of a group alone
            assert ours[address].name == plain(title)
    left = {row.name for row in ours.values() if row.address not in theirs}
    assert {row for row in left if not row.startswith("indirect")} == NOT_IN_FILES
    places = {title: address for address, (_, title) in theirs.items()}
    for n in range(4):
        where = (places["Indirect Address Read"] + 2 * n).to_bytes(2, "little")
        (said,) = bench.ask(3, where + (132 + n).to_bytes(2, "little"))
        assert said.error == NONE
    (said,) = bench.ask(2, places["Indirect Data Read"].to_bytes(2, "little") + bytes([4, 0]))
    assert (said.error, int.from_bytes(said.data, "little")) == (NONE, 2048)


@pytest.mark.parametrize("page", ALL_PAGES, ids=lambda page: page.name)
def test_a_rating_is_that_of_the_specifications(page: Page) -> None:
    rating = MODELS_BY_NUMBER[page.model].rating
    speed = rating.no_load_speed * 60.0 / (2.0 * math.pi)
    found = (rating.voltage, rating.stall_torque, speed, rating.stall_current)
    assert found == pytest.approx(RATINGS[page.model])


def test_each_model_of_the_package_has_a_page_here() -> None:
    assert set(MODELS_BY_NUMBER) == {page.model for page in ALL_PAGES}
