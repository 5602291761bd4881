"""Figures: what they show, their units, and bytes that repeat."""

import math
import os
import re
import subprocess
import sys
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from types import SimpleNamespace

import matplotlib as mpl
import numpy as np
import phone
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex
from matplotlib.text import Text
from PIL import Image

from antennate import figures as style
from antennate.control.registry import BUILT_IN, USUAL, looks
from antennate.experiments.antenna import figure as antenna
from antennate.experiments.antenna.config import AntennaConfig
from antennate.experiments.antenna.experiment import run as run_antenna
from antennate.experiments.tunnel import figure as tunnel
from antennate.experiments.tunnel.batch import run_trials
from antennate.experiments.tunnel.lockstep import SHOWN_TRIALS
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.experiments.wall import experiment as wall
from antennate.experiments.wall.physics import Traverse
from antennate.robots.spec import RobotSpec
from antennate.robots.wiring import wiring
from antennate.types import Maneuver
from antennate_lab.compete import figure as compete
from antennate_lab.compete.episodes import EpisodeRow
from antennate_lab.gait import figure as gait
from antennate_lab.gait.physics import Pace
from antennate_lab.gait.result import CostOfPhase, GaitResult, PhasePoint, WaveOff

ROOT = Path(__file__).parent.parent
LETTERS = {"tunnel.png": 8.0, "build_antenna.png": math.inf, "build_robot.png": math.inf}
"""The smallest letters of a picture of the docs, 7 if it is not named, inf without any [points]."""
OPENED = re.compile(r"\[!\[[^\]]*\]\(images/([^)]+)\)\]\(images/\1\)")
"""A picture on a page that opens in its full size."""
LIMIT = 50.0
WALLS = (np.array([[0.0, 0.3], [2.0, 0.3]]), np.array([[0.0, -0.3], [2.0, -0.3]]))


@dataclass
class Row:
    controller: str
    trial: int
    outcome: str
    time_s: float


@dataclass
class Course:
    head: np.ndarray
    maneuver: np.ndarray
    fixed: list[np.ndarray]
    before: list[np.ndarray]
    after: list[np.ndarray]
    exit: np.ndarray
    links: np.ndarray
    parts: list[np.ndarray]


def path(end: float, samples: int = 40) -> Course:
    """A straight course along x, through all maneuvers one after the other."""
    x = np.linspace(0.0, end, samples)
    box = 0.07 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    stood = [box + np.array([0.5, 0.2]), box + np.array([1.0, -0.2])]
    return Course(
        head=np.stack([x, 0.1 * np.sin(5 * x)], axis=1),
        maneuver=np.arange(samples) * len(Maneuver) // max(samples, 1),
        fixed=list(WALLS),
        before=stood,
        after=[polygon + 0.05 for polygon in stood],
        exit=np.array([wall[-1] for wall in WALLS]),
        links=np.stack([end - 0.1 * np.arange(6), np.zeros(6)], axis=1),
        parts=[box + np.array([end, 0.0])],
    )


def rows() -> list[Row]:
    outcomes = [("success", 10.0), ("success", 20.0), ("timeout", LIMIT), ("left", LIMIT)]
    return [Row(name, k, *end) for name in BUILT_IN for k, end in enumerate(outcomes)]


def summaries(**changes) -> dict[str, SimpleNamespace]:
    one = {
        "trials": 4,
        "invalid": 0,
        "successes": 2,
        "wilson95": (0.15, 0.85),
        "restricted_mean_time_s": 32.5,
        "restricted_mean_time_95": (12.5, 50.0),
    }
    return dict.fromkeys(BUILT_IN, SimpleNamespace(**{**one, **changes}))


def trajectories(names=USUAL, trials=range(4)):
    found = rows()
    paths = {(row.controller, row.trial): path(2.0) for row in found}
    paths["open", 3] = path(-40.0)  # far out of the entrance
    return tunnel.trajectories(paths, names, found, trials)


def one_trajectory():
    return trajectories(("open",), range(2, 3))


def walk_result() -> GaitResult:
    fast = {"speed_m_s": 0.2, "body_lengths_per_cycle": 0.5}
    pace = Pace(**fast, yaw_deg_per_cycle=0.0, cost_of_transport=0.4)
    return GaitResult(
        body_length_m=0.8,
        frequency_hz=0.5,
        maneuvers={m.name.lower(): pace for m in list(Maneuver)[:4]},
        wave_off=WaveOff(speed_m_s=0.12, expected_m_s=0.12, ratio=1.0),
        phase_sweep=[
            PhasePoint(
                body_phase_rad=float(a),
                speed_m_s=0.1 - 0.1 * np.cos(a),
                body_lengths_per_cycle=0.25 - 0.25 * np.cos(a),
            )
            for a in range(6)
        ],
        chosen_body_phase_rad=-2.5,
        best_body_phase_rad=3.0,
        cost_of_phase=CostOfPhase(chosen_over_best=0.9, worst_over_best=0.0),
        measured_body_lengths_per_cycle=None,
        unknown=None,
        optimised=None,
    )


@dataclass
class Walk:
    centre: np.ndarray


def study():
    walks = {m.name.lower(): Walk(path(2.0 * (m + 1)).head) for m in list(Maneuver)[:4]}
    return gait.study(walk_result(), walks)


def summary():
    return tunnel.summary(summaries(), rows(), LIMIT)


def springs_of_the_taper():
    return antenna.figures(run_antenna(AntennaConfig()))["taper"]


def cable():
    return wiring(RobotSpec())


@pytest.mark.parametrize(
    "draw", [one_trajectory, trajectories, summary, study, springs_of_the_taper, cable]
)
def test_letters_are_read_on_a_phone(draw):
    assert phone.smallest(draw()) >= phone.LEAST


def test_letters_of_the_pictures_of_the_docs_are_read_on_a_phone():
    pictures = [*ROOT.glob("docs/images/*.png"), *ROOT.glob("docs/science/*.png")]
    assert len(pictures) > 25
    pages = "".join(page.read_text() for page in ROOT.glob("docs/*.md"))
    for path in pictures:
        if path.name in OPENED.findall(pages):
            continue
        with Image.open(path) as image:
            inches = image.width / image.info["dpi"][0]
        height = phone.height(LETTERS.get(path.name, 7.0), inches)
        assert height >= phone.LEAST, (path.name, height)


def test_no_figure_asks_for_smaller_letters():
    for path in [*ROOT.glob("packages/*/src/**/*.py"), *ROOT.glob("docs/science/*.py")]:
        least = LETTERS["tunnel.png"] if path.parent.name == "tunnel" else 7.0
        for size in re.findall(r"fontsize=([0-9.]+)", path.read_text()):
            assert float(size) >= least, path


@pytest.mark.parametrize(
    "draw", [one_trajectory, pytest.param(summary, marks=pytest.mark.slow), study]
)
def test_the_same_data_give_the_same_bytes(draw):
    first, second = style.render(draw()), style.render(draw())
    assert first == second
    assert first["png"].startswith(b"\x89PNG")
    assert b"<dc:date>" not in first["svg"]


def test_rendering_twice_changes_nothing():
    figure = summary()
    assert style.render(figure) == style.render(figure)


def test_rendering_leaves_the_users_settings_alone():
    before = dict(mpl.rcParams)
    style.render(style.canvas(3.0, 3.0))
    assert dict(mpl.rcParams) == before


def test_the_users_settings_change_no_figure(monkeypatch):
    """As of a matplotlibrc: TeX where there is none, another cut of the margins, other lines."""
    plain = style.render(study())
    own = {"text.usetex": True, "savefig.bbox": "tight", "lines.linestyle": "--"}
    own |= {"axes.prop_cycle": mpl.cycler(color=["r"]), "axes.xmargin": 0.3}
    for name, value in own.items():
        monkeypatch.setitem(mpl.rcParams, name, value)
    assert style.render(study()) == plain


@pytest.mark.ci
def test_a_command_draws_though_its_terminal_belongs_to_a_notebook(tmp_path):
    words = [sys.executable, "-m", "antennate", "robot", "--out", tmp_path / "run", "--no-config"]
    own = os.environ | {"MPLBACKEND": "module://a_package_that_is_elsewhere"}
    subprocess.run(words, check=True, env=own, stdout=subprocess.DEVNULL)
    assert [*(tmp_path / "run/figures").glob("*.png")]


def test_names_are_written_as_they_are():
    """Matplotlib reads a formula between dollar signs, and leaves `_name` out of a legend."""
    names = ["_mine.onnx", "a$x$.onnx", "$\\frac{$.onnx"]
    ended = {"scene": "flat", "seed": 1, "trial": 0, "outcome": "success", "time_s": 2.0}
    rows = [EpisodeRow(controller=name, **ended) for name in names]
    figure = compete.profile(rows, names)
    style.render(figure)
    (legend,) = figure.legends
    texts = [text.get_text().strip().replace(r"\$", "$") for text in legend.get_texts()]
    assert texts == names


def test_axes_have_units():
    labels = [axis.get_xlabel() for axis in summary().axes] + [summary().axes[1].get_ylabel()]
    labels += [
        f(axis) for axis in study().axes for f in (type(axis).get_xlabel, type(axis).get_ylabel)
    ]
    panels = trajectories().axes
    labels += [panels[-1].get_xlabel(), panels[0].get_ylabel()]
    assert all(label.endswith(("[m]", "[s]", "[%]", "[m/s]", "[deg]")) for label in labels), labels


def test_trajectories_are_a_grid_with_the_verdict_of_each_trial():
    figure = trajectories()
    titles = [panel.get_title(loc="left") for panel in figure.axes]
    assert len(titles) == len(USUAL) * 4
    assert titles[:: len(USUAL)] == [
        "crossed, 10.0 s",
        "crossed, 20.0 s",
        "out of time",
        "left the scene",
    ]
    assert len(figure.legends) == 1
    places = np.array([panel.get_position().bounds for panel in figure.axes]).reshape(4, -1, 4)
    assert (np.ptp(places[..., 0], axis=0) < 1e-9).all()  # a column of panels for each controller
    assert (np.ptp(places[..., 1], axis=1) < 1e-9).all()  # a row for each trial
    assert (np.diff(places[0, :, 0]) > 0).all()
    assert (np.diff(places[:, 0, 1]) < 0).all()
    named = [[text.get_text() for text in panel.texts] for panel in figure.axes]
    assert named == [[name] for name in USUAL] + [[]] * (3 * len(USUAL))
    rows = [panel.get_ylabel() for panel in figure.axes[:: len(USUAL)]]
    assert rows == [f"trial {k}, y [m]" for k in range(4)]


def test_trajectories_of_three_trials_fit_on_a_slide():
    """Ours are 2 m by 1.2 m; a tunnel with its turn is as high as wide."""
    figure = trajectories(trials=range(3))
    assert figure.get_figheight() <= figure.get_figwidth()
    upright = {(name, t): upright_path() for name in USUAL for t in range(3)}
    figure = tunnel.trajectories(upright, USUAL, rows(), range(3))
    assert figure.get_figheight() <= 1.25 * figure.get_figwidth()


def upright_path() -> Course:
    """A course whose scene is as high as wide."""
    course = path(1.4)
    course.fixed = [np.array([[0.0, -0.3], [1.4, -0.3], [1.4, 1.0]])]
    course.exit = np.array([[1.0, 1.0], [1.4, 1.0]])
    return course


@pytest.mark.parametrize(
    "trials", [1, *(pytest.param(n, marks=pytest.mark.slow) for n in (2, 3)), 4]
)
@pytest.mark.parametrize("names", [("open",), tuple(BUILT_IN)])
def test_no_words_of_trajectories_lie_on_others_or_are_cut(trials, names):
    """Titles, names, ticks, labels and legend, also where one scene is larger than others."""
    figure = trajectories(names, range(4 - trials, 4))
    renderer = FigureCanvasAgg(figure).get_renderer()
    figure.draw(renderer)
    hidden = {
        tick.label1
        for panel in figure.axes
        for axis in (panel.xaxis, panel.yaxis)
        for tick in axis.get_major_ticks()
        if not axis.get_view_interval()[0] <= tick.get_loc() <= axis.get_view_interval()[1]
    }
    texts = [text for text in figure.findobj(Text) if text.get_text() and text.get_visible()]
    texts = [text for text in texts if text not in hidden]
    boxes = {text: text.get_window_extent(renderer) for text in texts}
    for one, two in combinations(texts, 2):
        assert not boxes[one].overlaps(boxes[two]), (one, two)
    for text, box in boxes.items():
        assert 0 <= box.x0 <= box.x1 <= figure.bbox.x1, text
        assert 0 <= box.y0 <= box.y1 <= figure.bbox.y1, text


def test_trajectories_of_different_extent_have_the_same_ticks():
    """A small scene alone would have closer ones than a large one."""
    small = path(0.5)
    small.fixed, small.exit = [0.3 * wall for wall in WALLS], 0.3 * small.exit
    small.before, small.after = [], []
    paths, found = {("open", 0): small, ("open", 1): path(2.0)}, rows()
    figure = tunnel.trajectories(paths, ("open",), found, range(2))
    figure.draw_without_rendering()
    for axis in (panel.xaxis for panel in figure.axes):
        assert {float(each) for each in np.diff(axis.get_majorticklocs())} == {1.0}


def test_lines_of_the_taper_have_four_colours_and_the_ladder_that_of_its_profile():
    panel = springs_of_the_taper().axes[0]
    stretches, ladder, suggested = (to_hex(each.get_edgecolor()) for each in panel.patches)
    colours = {to_hex(panel.lines[0].get_color()), stretches, ladder, suggested}
    assert len(colours) == 4
    assert ladder == to_hex(style.PROFILE_LOOKS["descending"][0])
    profiles = {to_hex(colour) for colour, _, _ in style.PROFILE_LOOKS.values()}
    assert colours & profiles == {ladder}


def test_robots_far_outside_do_not_stretch_the_panels():
    figure = trajectories()
    figure.draw_without_rendering()
    for panel in figure.axes:
        assert panel.get_xlim() == pytest.approx((-0.3, 2.3))
        assert panel.get_ylim() == pytest.approx((-0.6, 0.6))
        assert panel.get_aspect() == 1.0


def test_every_maneuver_has_its_own_colour_on_the_course():
    panel = trajectories().axes[0]
    drawn = {line.get_color() for line in panel.lines}
    assert set(style.MANEUVER_COLOURS.values()) <= drawn
    assert len(set(style.MANEUVER_COLOURS.values())) == len(Maneuver)
    drawn = looks(BUILT_IN).values()
    assert len({colour for colour, _ in drawn}) == len({str(line) for _, line in drawn}) == 14


def test_trials_without_a_course_leave_an_empty_panel():
    nothing = Course(
        np.zeros((0, 2)), np.zeros(0), list(WALLS), [], [], WALLS[0], np.full((6, 2), np.nan), []
    )
    figure = tunnel.trajectories(
        {("open", 0): nothing}, ("open",), [Row("open", 0, "invalid", LIMIT)], range(2)
    )
    style.render(figure)
    assert [p.get_title(loc="left") for p in figure.axes] == ["invalid", "not run"]


def test_curve_drops_at_exits_and_failures_stay():
    curve = summary().axes[1].lines[0]
    x, y = curve.get_data()
    assert list(x) == [0.0, 10.0, 20.0, LIMIT]
    assert list(y) == [1.0, 0.75, 0.5, 0.5]
    assert curve.get_drawstyle() == "steps-post"


def test_a_controller_without_a_valid_trial_is_left_blank():
    empty = summaries(invalid=4, successes=0, restricted_mean_time_s=None)["open"]
    figure = tunnel.summary({"open": empty}, [Row("open", 0, "invalid", LIMIT)], LIMIT)
    style.render(figure)
    assert figure.axes[0].get_yticklabels()[0].get_text() == "open\nn = 0"


def test_the_chosen_lead_is_marked_within_one_turn():
    marked = study().axes[0].lines[2]
    assert list(marked.get_xdata()) == pytest.approx([np.degrees(-2.5) + 360.0])
    assert list(marked.get_ydata()) == [0.2]


def test_intervals_reach_from_end_to_end_and_leave_out_what_does_not_exist():
    panel = style.canvas(3.0, 3.0).subplots()
    rows = [{"f": 2.0, "f_95": (1.0, 4.0)}, {"f": None, "f_95": None}, {"f": 5.0, "f_95": None}]
    style.intervals(panel, [0, 1, 2], rows, ("f", "f_95"), label="f")
    points, _, (whiskers,) = panel.containers[0]
    assert points.get_xydata().tolist() == [[0.0, 2.0], [2.0, 5.0]]
    ends = [segment[:, 1].tolist() for segment in whiskers.get_segments()]
    assert ends == [[1.0, 4.0], [5.0, 5.0]]


def test_the_legend_names_only_what_the_scene_has():
    def named(course):
        paths = {("open", 0): course}
        figure = tunnel.trajectories(paths, ("open",), [Row("open", 0, "left", LIMIT)], range(1))
        return {text.get_text() for text in figure.legends[0].get_texts()}

    bare = path(2.0)
    bare.fixed, bare.before, bare.after = [], [], []
    assert named(path(2.0)) - named(bare) == {"wall", "obstacle at first", "obstacle at the end"}


@pytest.mark.parametrize(("trials", "ends"), [(4, [0.5, 0.5]), (5, [0.15, 0.85])])
def test_an_interval_of_a_mean_is_drawn_where_there_are_enough_trials(trials, ends):
    """That of a share holds for any count."""
    one = summaries(trials=trials, successes=trials / 2)["open"]
    figure = tunnel.summary({"open": one}, rows(), LIMIT)
    share, _, time = figure.axes
    drawn = np.concatenate([line.get_xdata() for line in share.lines])
    assert [drawn.min(), drawn.max()] == pytest.approx([0.15, 0.85])
    drawn = np.concatenate([line.get_xdata() for line in time.lines])
    few = trials < style.ENOUGH_TRIALS
    assert [drawn.min(), drawn.max()] == ([32.5, 32.5] if few else [12.5, 50.0])
    assert "no intervals" not in share.get_title(loc="left")
    said = time.get_title(loc="left")
    assert said.startswith("Time to the exit; ")
    assert ("no intervals below 5 trials" in said) == few

    panel = style.canvas(3.0, 3.0).subplots()
    found = [{"f": 0.5, "f_95": (0.15, 0.85)}]
    style.intervals(panel, [0], found, ("f", "f_95"), trials)
    (segment,) = panel.containers[0][2][0].get_segments()
    assert segment[:, 1].tolist() == pytest.approx(ends)


def test_the_robot_is_drawn_with_all_its_parts():
    course = path(2.0)
    course.parts = [course.parts[0] + shift for shift in (0.0, 0.1, 0.2)]
    figure = tunnel.trajectories(
        {("open", 0): course}, ("open",), [Row("open", 0, "left", LIMIT)], range(1)
    )
    robot = max(figure.axes[0].collections, key=lambda drawn: drawn.get_zorder())
    shown = [drawn.vertices[:4].tolist() for drawn in robot.get_paths()]
    assert shown == [part.tolist() for part in course.parts]


def test_each_profile_has_its_colour_and_its_boulders_along_the_wall():
    straight = np.stack([np.linspace(-0.1, 0.0, 7), np.linspace(0.0, 0.1, 7)], axis=1)
    boulders = np.array([[0.003, y, 0.003] for y in np.arange(-0.2, 0.3, 0.006)])
    zero = np.zeros(5)
    seen = Traverse(zero, zero, zero, zero, zero, zero, np.tile(straight, (11, 1, 1)), boulders)
    figure = wall.passages({(profile, 0): seen for profile in ("ascending", "stiff")})
    for profile, panel in zip(("ascending", "stiff"), figure.axes[1::2], strict=True):
        assert {line.get_color() for line in panel.lines} == {style.PROFILE_LOOKS[profile][0]}
        circles = [patch.get_center() for patch in panel.patches]
        assert len(circles) == np.sum((boulders[:, 1] > 0.0) & (boulders[:, 1] < 0.1))
        assert {x for x, _ in circles} == {3.0}  # [mm]: the crests are at 0


def test_paths_are_kept_of_the_trials_that_are_drawn():
    found = {}

    def take(item):
        found[item[0].trial] = item[1]

    last = SHOWN_TRIALS - 1
    run_trials(TunnelConfig(time_limit=0.02), "open", [last, last + 1], take)
    assert found[last].parts
    assert found[last].before
    assert found[last + 1] is None


def test_no_two_controllers_of_a_figure_have_one_colour():
    names = ["timed", "closed", "closed@yoked", "closed@swapped", "a.py:a", "b.py:b"]
    assert len({colour for colour, _ in looks(names).values()}) == len(names)
