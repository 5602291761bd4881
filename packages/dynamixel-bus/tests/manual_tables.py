"""The control tables of twelve models, copied number by number from the pages of the manual.

Sources: https://emanual.robotis.com/docs/en/dxl/x/xc430-w240/, and so on by their names. An XM430
has the voltage limits of the page of the XM430-W210; Drive Mode, Startup Configuration and Backup
Ready of an XM430 and XM540 are those of the newest page, that of the XM540-W150.
Columns: address, size, name, access, initial value, smallest and largest value that may be written;
"-" where the page says nothing. A value "~NAME" is bounded by that register, "?" by its own rule.
Signed registers are marked by "s" after the size.
"""

from __future__ import annotations

from typing import NamedTuple

_COMMON = """
0    2  model_number           R   MODEL -        -
2    4  model_information      R   -     -        -
6    1  firmware_version       R   -     -        -
7    1  id                     RW  1     0        252
8    1  baud_rate              RW  1     0        7
9    1  return_delay_time      RW  250   0        254
10   1  drive_mode             RW  0     0        13
11   1  operating_mode         RW  3     ?        ?
12   1  secondary_id           RW  255   0        252
13   1  protocol_type          RW  2     ?        ?
20   4s homing_offset          RW  0     -1044479 1044479
24   4  moving_threshold       RW  10    0        1023
31   1  temperature_limit      RW  80    0        100
32   2  max_voltage_limit      RW  160   60       160
34   2  min_voltage_limit      RW  60    60       160
36   2  pwm_limit              RW  885   0        885
44   4  velocity_limit         RW  306   0        1023
48   4  max_position_limit     RW  4095  0        4095
52   4  min_position_limit     RW  0     0        4095
60   1  startup_configuration  RW  0     0        3
63   1  shutdown               RW  52    -        -
64   1  torque_enable          RW  0     0        1
65   1  led                    RW  0     0        1
68   1  status_return_level    RW  2     0        2
69   1  registered_instruction R   0     -        -
70   1  hardware_error_status  R   0     -        -
76   2  velocity_i_gain        RW  1920  0        16383
78   2  velocity_p_gain        RW  100   0        16383
80   2  position_d_gain        RW  0     0        16383
82   2  position_i_gain        RW  0     0        16383
84   2  position_p_gain        RW  700   0        16383
88   2  feedforward_2nd_gain   RW  0     0        16383
90   2  feedforward_1st_gain   RW  0     0        16383
98   1s bus_watchdog           RW  0     0        127
100  2s goal_pwm               RW  -     ~pwm_limit ~
104  4s goal_velocity          RW  -     ~velocity_limit ~
108  4  profile_acceleration   RW  0     0        32767
112  4  profile_velocity       RW  0     ~velocity_limit ~
116  4s goal_position          RW  -     ?        ?
120  2  realtime_tick          R   -     -        -
122  1  moving                 R   0     -        -
123  1  moving_status          R   0     -        -
124  2s present_pwm            R   -     -        -
126  2s present_load           R   -     -        -
128  4s present_velocity       R   -     -        -
132  4s present_position       R   -     -        -
136  4s velocity_trajectory    R   -     -        -
140  4s position_trajectory    R   -     -        -
144  2  present_input_voltage  R   -     -        -
146  1  present_temperature    R   -     -        -
147  1  backup_ready           R   -     -        -
"""
_XL430 = """
31   1  temperature_limit      RW  72    0        100
32   2  max_voltage_limit      RW  140   60       140
34   2  min_voltage_limit      RW  60    60       140
44   4  velocity_limit         RW  265   0        1023
76   2  velocity_i_gain        RW  1000  0        16383
80   2  position_d_gain        RW  4000  0        16383
84   2  position_p_gain        RW  640   0        16383
"""
_XL330 = """
8    1  baud_rate              RW  1     0        6
10   1  drive_mode             RW  0     0        5
31   1  temperature_limit      RW  70    0        100
32   2  max_voltage_limit      RW  70    31       70
34   2  min_voltage_limit      RW  35    31       70
38   2  current_limit          RW  1750  0        1750
44   4  velocity_limit         RW  445   0        2047
62   1  pwm_slope              RW  140   1        255
63   1  shutdown               RW  53    -        -
76   2  velocity_i_gain        RW  1600  0        16383
78   2  velocity_p_gain        RW  180   0        16383
84   2  position_p_gain        RW  400   0        16383
102  2s goal_current           RW  -     ~current_limit ~
126  2s present_current        R   -     -        -
"""


_M077 = """
44   4  velocity_limit         RW  1620  0        2047
76   2  velocity_i_gain        RW  400   0        16383
78   2  velocity_p_gain        RW  40    0        16383
82   2  position_i_gain        RW  400   0        16383
"""
_XC330_M288 = """
10   1  drive_mode             RW  0     0        13
38   2  current_limit          RW  2352  0        2352
44   4  velocity_limit         RW  350   0        2047
63   1  shutdown               RW  52    -        -
78   2  velocity_p_gain        RW  50    0        16383
80   2  position_d_gain        RW  500   0        16383
84   2  position_p_gain        RW  1100  0        16383
"""
_XC330_M181 = """
44   4  velocity_limit         RW  545   0        2047
76   2  velocity_i_gain        RW  1400  0        16383
78   2  velocity_p_gain        RW  100   0        16383
84   2  position_p_gain        RW  1200  0        16383
"""
_XC330_T288 = """
32   2  max_voltage_limit      RW  140   55       140
34   2  min_voltage_limit      RW  55    55       140
38   2  current_limit          RW  910   0        910
44   4  velocity_limit         RW  320   0        2047
62   1  pwm_slope              RW  255   1        255
76   2  velocity_i_gain        RW  1200  0        16383
78   2  velocity_p_gain        RW  40    0        16383
80   2  position_d_gain        RW  0     0        16383
84   2  position_p_gain        RW  900   0        16383
"""
_XC330_T181 = """
44   4  velocity_limit         RW  510   0        2047
"""
_XM430_W350 = """
32   2  max_voltage_limit      RW  160   95       160
34   2  min_voltage_limit      RW  95    95       160
38   2  current_limit          RW  1193  0        1193
44   4  velocity_limit         RW  200   0        1023
84   2  position_p_gain        RW  800   0        16383
102  2s goal_current           RW  -     ~current_limit ~
126  2s present_current        R   -     -        -
"""
_XM430_W210 = """
44   4  velocity_limit         RW  330   0        1023
"""
_XM540_W270 = """
38   2  current_limit          RW  2047  0        2047
44   4  velocity_limit         RW  128   0        1023
56   1  external_port_mode_1   RW  3     0        3
57   1  external_port_mode_2   RW  3     0        3
58   1  external_port_mode_3   RW  3     0        3
152  2  external_port_data_1   RW  -     -        -
154  2  external_port_data_2   RW  -     -        -
156  2  external_port_data_3   RW  -     -        -
"""
_XM540_W150 = """
44   4  velocity_limit         RW  230   0        1023
"""


class Row(NamedTuple):
    """One line of the manual."""

    name: str
    address: int
    size: int
    signed: bool
    writable: bool
    initial: int | None
    low: str
    high: str


class Page(NamedTuple):
    """One page of the manual: rows by address, and operating modes."""

    name: str
    model: int
    modes: set[int]
    rows: dict[int, Row]

    def row(self, name: str) -> Row:
        return next(row for row in self.rows.values() if row.name == name)


def _rows(text: str, model: int) -> dict[int, Row]:
    found: dict[int, Row] = {}
    for line in text.strip().splitlines():
        address, size, name, access, initial, low, high = line.split()
        value = {"-": None, "MODEL": model}.get(initial, initial)
        number = None if value is None else int(value)
        found[int(address)] = Row(
            name, int(address), int(size[0]), "s" in size, access == "RW", number, low, high
        )
    return found


def _indirect(first: int, address: int, data: int, count: int, last: int) -> dict[int, Row]:
    """`count` indirect addresses of two bytes and as many indirect data of one."""
    found: dict[int, Row] = {}
    for n in range(count):
        places = address + 2 * n, data + n
        found[places[0]] = Row(
            f"indirect_address_{first + n}", places[0], 2, False, True, places[1], "64", str(last)
        )
        found[places[1]] = Row(
            f"indirect_data_{first + n}", places[1], 1, False, True, 0, "0", "255"
        )
    return found


_LONG = _indirect(1, 168, 224, 28, 661) | _indirect(29, 578, 634, 28, 661)
_SHORT = _indirect(1, 168, 208, 20, 227)

PAGES = [
    Page("XC430-W240-T", 1080, {1, 3, 4, 16}, _rows(_COMMON, 1080) | _LONG),
    Page("XL430-W250-T", 1060, {1, 3, 4, 16}, _rows(_COMMON, 1060) | _rows(_XL430, 1060) | _LONG),
    Page(
        "XL330-M288-T",
        1200,
        {0, 1, 3, 4, 5, 16},
        _rows(_COMMON, 1200) | _rows(_XL330, 1200) | _SHORT,
    ),
]
"""Those whose effects are tried one by one, in tests/test_control_effects.py."""
_SIX = {0, 1, 3, 4, 5, 16}


def _small(name: str, model: int, *tables: str) -> Page:
    """The page of a servo of the size 330."""
    rows = [_rows(table, model) for table in (_COMMON, _XL330, *tables)]
    return Page(name, model, _SIX, {k: v for table in (*rows, _SHORT) for k, v in table.items()})


def _large(name: str, model: int, *tables: str) -> Page:
    """The page of a servo of the size 430 or 540 that measures its current."""
    rows = [_rows(table, model) for table in (_COMMON, _XM430_W350, *tables)]
    return Page(name, model, _SIX, {k: v for table in (*rows, _LONG) for k, v in table.items()})


ALL_PAGES = [
    *PAGES,
    _small("XL330-M077-T", 1190, _M077),
    _small("XC330-M288-T", 1240, _XC330_M288),
    _small("XC330-M181-T", 1230, _XC330_M288, _XC330_M181),
    _small("XC330-T288-T", 1220, _XC330_M288, _XC330_T288),
    _small("XC330-T181-T", 1210, _XC330_M288, _XC330_T288, _XC330_T181),
    _large("XM430-W350-T", 1020),
    _large("XM430-W210-T", 1030, _XM430_W210),
    _large("XM540-W270-T", 1120, _XM540_W270),
    _large("XM540-W150-T", 1130, _XM540_W270, _XM540_W150),
]
SIZE_330 = {1190, 1200, 1210, 1220, 1230, 1240}
"""Models whose pages allow Protocol Type 2 and 20 to 22."""
RATINGS = {
    1080: (11.1, 1.7, 65.0, 1.3),
    1060: (11.1, 1.4, 57.0, 1.3),
    1200: (5.0, 0.52, 103.0, 1.47),
    1190: (5.0, 0.215, 383.0, 1.47),
    1240: (5.0, 0.93, 81.0, 1.80),
    1230: (5.0, 0.60, 129.0, 1.80),
    1220: (11.1, 0.92, 65.0, 0.80),
    1210: (11.1, 0.76, 104.0, 0.80),
    1020: (11.1, 3.8, 43.0, 2.1),
    1030: (11.1, 2.7, 70.0, 2.1),
    1120: (11.1, 10.0, 28.0, 4.2),
    1130: (11.1, 6.9, 50.0, 4.2),
}
"""Supply [V], stall torque [N·m], no-load speed [rev/min] and stall current [A], from section
Specifications."""
BAUD_RATES = [9_600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000]
"""Of the register Baud Rate; the XL330's page stops at 4 Mbps."""
STALL_CURRENT = {model: amperes for model, (_, _, _, amperes) in RATINGS.items()}
NO_LOAD_SPEED = {model: speed for model, (_, _, speed, _) in RATINGS.items()}
