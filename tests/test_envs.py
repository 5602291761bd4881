"""Environments of Gymnasium: the interface, and that an episode follows from its number alone."""

from __future__ import annotations

import copy
import json
import pickle
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

from antennate import envs
from antennate.control.policy.interface import PolicyInterface, observations
from antennate.envs.reward import EARLY, EXIT, HOLD, PROGRESS, TIME
from antennate.errors import BadInputError, ConfigError
from antennate.experiments.tunnel.batch import run_trials
from antennate.experiments.tunnel.physics import TrialResult, TunnelConfig
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.sim.scenes.registry import SCENES
from antennate.sim.scenes.scene import FlatScene
from antennate.sim.scenes.wall import GAP

IDS = envs.ids()
SHORT = {"time_limit": 1.0}
MODES = ("maneuver", "gait", "joints")


def single(name: str = "Tunnel", **values: Any) -> Any:
    return gym.make(f"antennate/{name}-v1", **values).unwrapped


def vector(rows: int, name: str = "Tunnel", **values: Any) -> Any:
    return gym.make_vec(f"antennate/{name}-v1", num_envs=rows, **values)


def script(length: int, seed: int = 0) -> np.ndarray:
    """Maneuvers drawn at random, in runs of five."""
    return np.repeat(np.random.default_rng(seed).integers(0, 4, length), 5)[:length]


# the interface


@pytest.mark.parametrize("name", IDS)
def test_the_checker_of_gymnasium_is_content(name: str) -> None:
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        for mode in MODES if name.endswith(("Flat-v1", "Tunnel-v1")) else MODES[:2]:
            check_env(gym.make(name, action=mode).unwrapped, skip_render_check=True)
    assert [str(one.message) for one in found] == []


def test_every_scene_has_one_and_those_of_the_benchmark_keep_their_names() -> None:
    names = {name.partition("/")[2] for name in IDS}
    assert {"Tunnel-v1", "UTurn-v1", "Corner120-v1", "Wall-v1", "Flat-v1"} <= names
    assert set(IDS.values()) == set(SCENES.names)


def test_a_scene_that_is_added_gets_one(monkeypatch: pytest.MonkeyPatch) -> None:
    SCENES.add("short-floor", lambda: FlatScene(0.5))
    try:
        assert "antennate/ShortFloor-v1" in envs.register()
        _, info = gym.make("antennate/ShortFloor-v1").reset(seed=1)
        assert info["length"] == 0.5
    finally:
        del SCENES.added["short-floor"]
        for name in ("antennate/ShortFloor-v1", "ShortFloor-v1"):
            del gym.registry[name]


def test_scenes_without_an_id_of_their_own_are_named_and_the_others_have_theirs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name in ("my-floor", "my_floor", "my floor"):
        monkeypatch.setitem(SCENES.added, name, lambda: FlatScene(0.5))
    with pytest.warns(UserWarning, match="expected") as found:
        ids = envs.ids()
    assert ids == {**IDS, "antennate/MyFloor-v1": "my-floor"}
    first, second = (str(one.message) for one in found)
    assert first.startswith("antennate/MyFloor-v1: ")
    assert first.endswith(" found my-floor and my_floor")
    assert second.startswith("my floor: expected letters")


def test_a_render_mode_is_refused_as_libraries_that_try_one_expect() -> None:
    """Stable-Baselines3 2.9 asks for pictures, and after a TypeError for none."""
    with pytest.raises(TypeError, match="render_mode: expected None") as error:
        envs.AntennaEnv("flat", render_mode="rgb_array")
    assert isinstance(error.value, ConfigError)


def test_an_id_that_another_package_has_taken_stays_and_a_warning_says_so() -> None:
    ours = gym.registry.pop("Tunnel-v1")
    try:
        gym.register("Tunnel-v1", entry_point="elsewhere:Env")
        with pytest.warns(UserWarning, match="Tunnel-v1: .* elsewhere:Env; take antennate/Tunnel"):
            envs.register()
        assert gym.spec("Tunnel-v1").entry_point == "elsewhere:Env"
    finally:
        gym.registry["Tunnel-v1"] = ours


@pytest.mark.ci
def test_gymnasium_finds_them_by_the_package_which_stays_free_of_it() -> None:
    code = (
        "import sys, antennate; assert 'gymnasium' not in sys.modules; "
        "del sys.modules['antennate']; "
        "import gymnasium; print(gymnasium.make('antennate:Tunnel-v1').spec.kwargs)"
    )
    reply = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert reply.stdout.strip() == "{'scene': 'tunnel'}"


@pytest.mark.parametrize("mode", MODES)
def test_observations_are_as_their_table_says(mode: str) -> None:
    env = single(action=mode)
    table = observations(PolicyInterface(action=mode), ControlParams(), RobotSpec())
    assert env.observation_space.shape == (len(table),)
    observation, _ = env.reset(seed=4)
    named = dict(zip((q.name for q in table), observation.tolist(), strict=True))
    assert named["phase sin"] ** 2 + named["phase cos"] ** 2 == pytest.approx(1.0, abs=1e-6)
    assert named["flex_l -0.1 s"] == named["pace 0 s"] == 0.0


# one episode


def test_an_episode_is_the_trial_of_tunnel_with_its_number() -> None:
    rows: list[TrialResult] = []
    run_trials(TunnelConfig(seed=5, scene="flat"), "open", range(2), lambda r: rows.append(r[0]))
    for row in rows:
        env = single("Flat")
        env.reset(seed=5, options={"episode_number": row.trial})
        info, over = {}, False
        while not over:
            _, _, ended, cut, info = env.step(0)
            over = ended or cut
        assert (info["outcome"], info["seed"], info["episode_number"]) == (
            row.outcome,
            5,
            row.trial,
        )
        assert round(min(info["progress"], info["length"]), 6) == row.progress_m
        if row.outcome == "success":
            assert round(info["t"], 6) == row.time_s
    assert "success" in {row.outcome for row in rows}


def test_the_reward_is_progress_time_and_exit() -> None:
    env = single("Flat")
    _, begin = env.reset(seed=2)
    total, count, sums, over, info = 0.0, 0, np.zeros(3), False, {}
    while not over:
        _, reward, over, _, info = env.step(0)
        total, count = total + reward, count + 1
        sums += [info[f"reward_{term.name}"] for term in (PROGRESS, TIME, EXIT)]
    assert info["outcome"] == "success"
    assert sums.tolist() == pytest.approx([info["progress"] - begin["progress"], -0.01 * count, 1])
    assert total == pytest.approx(sums.sum())


@pytest.mark.parametrize("values", [{}, {"ticks": 50}, {"max_episode_steps": 300}])
def test_who_leaves_by_the_entrance_pays_for_all_the_time_that_is_left(
    values: dict[str, Any],
) -> None:
    """A failure costs as much as to stay until the limit of 100 s, whenever it comes."""
    ticks = values.pop("ticks", 10)
    env = envs.AntennaEnv("uturn", interface={"ticks": ticks}, **values)
    _, begin = env.reset(seed=1)
    total, count, over, info = 0.0, 0, False, {}
    while not over:
        _, reward, over, _, info = env.step(3)  # REVERSE
        total, count = total + reward, count + 1
    assert (info["outcome"], info["t"] < 20) == ("left", True)
    most = values.get("max_episode_steps", 10_000 // ticks)
    assert info["reward_early"] == pytest.approx(EARLY.weight * (most - count))
    assert total == pytest.approx(info["progress"] - begin["progress"] - 0.01 * most)


def test_a_scene_of_ones_own_may_call_its_parts_as_it_likes(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(
        "from antennate.sim.scenes.scene import FlatScene\n"
        "class Gaps(FlatScene):\n"
        "    def draw(self, robot, rng):\n"
        "        drawn = super().draw(robot, rng)\n"
        "        drawn.gap = 0.3\n"
        "        return drawn\n"
    )
    env = envs.AntennaEnv(f"{tmp_path / 'own.py'}:Gaps")
    env.reset(seed=1)
    assert env.step(0)[4]["reward_hold"] == 0.0


def test_beside_the_wall_the_gap_counts() -> None:
    env = single("Wall")
    env.reset(seed=3)
    for _ in range(5):
        *_, info = env.step(0)
        wall = env.world.model.geom("wall")
        gap = abs(wall.pos[1] - info["head"][1]) - wall.size[1] - RobotSpec().width / 2
        assert info["reward_hold"] == pytest.approx(HOLD.weight * abs(gap - GAP), abs=1e-9)


def test_time_and_number_of_decisions_truncate() -> None:
    for values, ticks in (({"time_limit": 0.5}, 50), ({"max_episode_steps": 3}, 29)):
        env = envs.AntennaEnv("flat", **values)
        env.reset(seed=1)
        ended = cut = False
        while not (ended or cut):
            _, _, ended, cut, info = env.step(0)
        assert (cut, ended, info["outcome"]) == (True, False, "timeout")
        assert round(100 * info["t"]) == ticks
    with pytest.raises(ResetNeeded):
        env.step(0)


def test_a_robot_on_its_back_has_overturned() -> None:
    env = single("Flat")
    with pytest.raises(ResetNeeded, match="before the world"):
        _ = env.world
    env.reset(seed=1)
    world = env.world
    quaternion = world.data.qpos[world.root + 3 : world.root + 7]
    quaternion[:], world.data.qpos[world.root + 2] = (0.0, 1.0, 0.0, 0.0), 0.1
    *_, ended, cut, info = env.step(0)
    assert (ended, cut, info["outcome"]) == (True, False, "overturned")


def test_a_robot_that_walks_into_a_wide_gap_has_fallen() -> None:
    env = single("Gap", robot=RobotSpec.named("scuttle3d"), ground={"width": 0.5})
    env.reset(seed=1)
    ended, cut, info = False, False, {}
    while not (ended or cut):
        *_, ended, cut, info = env.step(0)
    assert (ended, cut, info["outcome"]) == (True, False, "fell")


def test_an_action_that_is_no_number_is_hold() -> None:
    env = single("Flat", action="gait")
    env.reset(seed=1)
    _, begin = env.reset(seed=1)
    *_, info = env.step(np.full(4, np.nan, np.float32))
    assert info["maneuver"] == 4
    assert np.abs(info["head"][:2] - begin["head"][:2]).max() < 2e-3


def test_a_gait_turns_to_the_side_of_its_offset() -> None:
    """Positive turns right, as of the yaw offset of our gait: the heading falls."""
    for offset, sign in ((1.0, -1.0), (-1.0, 1.0)):
        env = single("Flat", action="gait")
        _, begin = env.reset(seed=1)
        for _ in range(50):
            *_, info = env.step(np.array([0.2, offset, 0.0, 1.0], np.float32))
        assert sign * (info["head"][2] - begin["head"][2]) > 0.3


def test_who_has_turned_from_the_route_has_it_on_the_other_side() -> None:
    """The route of the default tunnel leads straight ahead for more than a metre at first."""
    for offset, side in ((1.0, 1), (-1.0, -1)):  # right, left
        env = single("Tunnel", action="gait")
        _, begin = env.reset(seed=1)
        for _ in range(30):
            *_, info = env.step(np.array([0.2, offset, 0.0, 1.0], np.float32))
        assert (begin["side"], info["side"]) == (0, side)


def test_nothing_of_the_truth_is_observed_without_readings() -> None:
    """With readings none nothing is felt, whatever it meets."""
    env = single(readings="none")
    env.reset(seed=1)
    walked = [env.step(action)[0] for action in script(30, seed=2)]
    names = [q.name for q in observations(PolicyInterface(), ControlParams(), RobotSpec())]
    felt = [i for i, name in enumerate(names) if name.startswith("flex")]
    assert np.abs(np.array(walked)[:, felt]).max() == 0.0


# nothing but seed and number decides


def observed(scene: str, numbers: list[int]) -> list[str]:
    """First observations and heads, by one environment that walks a little in each episode."""
    env, texts = single(scene, interface={"ticks": 2}), []
    for number in numbers:
        observation, info = env.reset(seed=7, options={"episode_number": number})
        texts.append(observation.tobytes().hex() + info["head"].tobytes().hex())
        for step in range(2):
            env.step((number + step) % 4)
    return texts


@pytest.mark.ci
@pytest.mark.parametrize(("scene", "resets"), [("Wall", 200), ("Broken", 20)])
def test_resets_are_those_of_a_fresh_process_in_another_order(scene: str, resets: int) -> None:
    """benchmarks/envs.py does it with 4,096."""
    numbers = [*range(resets)]
    code = (
        f"import json, test_envs; print(json.dumps(test_envs.observed('{scene}', {numbers[::-1]})))"
    )
    words = [sys.executable, "-W", "ignore", "-c", code]
    folder = __file__.rpartition("/")[0]
    reply = subprocess.run(words, capture_output=True, text=True, check=True, cwd=folder).stdout
    ours = observed(scene, numbers)
    assert json.loads(reply)[::-1] == ours
    assert len(set(ours)) == resets


def walk(env: Any, actions: np.ndarray, seed: int) -> list[tuple[Any, ...]]:
    """Everything that a row of one robot gives, reset after reset."""
    seen: list[tuple[Any, ...]] = []
    observation, info = env.reset(seed=seed)
    for action in actions:
        seen.append((observation.tobytes(), info["seed"], info["episode_number"], info["t"]))
        observation, reward, ended, cut, info = env.step(action)
        seen.append((observation.tobytes(), reward, ended, cut, info.get("outcome")))
        if ended or cut:
            observation, info = env.reset()
    return seen


def test_a_reset_without_a_seed_goes_on_with_the_next_episode() -> None:
    actions = script(25)
    first, second = (walk(single(**SHORT), actions, 8) for _ in range(2))
    assert first == second
    env = single(**SHORT)
    walk(env, script(13, seed=1), 9)
    assert walk(env, actions, 8) == first
    assert {entry[2] for entry in first[::2]} == {0, 1, 2}


def test_rows_of_a_vector_are_the_episodes_of_one_robot() -> None:
    """Row i of three plays the episodes i, i + 3 ...; the others do not matter."""
    actions = np.stack([script(24, seed=i) for i in range(3)], axis=1)
    many = vector(3, autoreset_mode="SAME_STEP", **SHORT)
    observation, _ = many.reset(seed=6)
    rows = [[observation[i].tobytes()] for i in range(3)]
    for action in actions:
        observation, *_ = many.step(action)
        for i in range(3):
            rows[i].append(observation[i].tobytes())
    for i in range(3):
        env, number, alone = single(**SHORT), i, []
        observation, _ = env.reset(seed=6, options={"episode_number": number})
        alone.append(observation.tobytes())
        for action in actions[:, i]:
            observation, _, ended, cut, _ = env.step(action)
            if ended or cut:
                number += 3
                observation, _ = env.reset(seed=6, options={"episode_number": number})
            alone.append(observation.tobytes())
        assert rows[i] == alone


def test_the_three_ways_to_reset_give_the_same_episodes() -> None:
    """What a row observes, its rewards and its last observation do not depend on the mode."""
    seen = {mode: episodes_of(mode, 40) for mode in AutoresetMode}
    shortest = min(len(ends) for ends in seen.values())
    assert shortest >= 4
    first, *others = (sorted(ends)[:4] for ends in seen.values())
    assert all(other == first for other in others)


def episodes_of(mode: AutoresetMode, steps: int) -> list[tuple[Any, ...]]:
    """Number, decisions, sum of rewards and last observation of each episode that ended."""
    env = vector(2, autoreset_mode=mode, **SHORT)
    assert (env.metadata["autoreset_mode"], env.metadata["reward_version"]) == (mode, 1)
    _, info = env.reset(seed=3)
    number, count, total = info["episode_number"].copy(), np.zeros(2, int), np.zeros(2)
    over, ends = np.zeros(2, bool), list[tuple[Any, ...]]()
    for _ in range(steps):
        if mode is AutoresetMode.DISABLED and over.any():
            _, info = env.reset(options={"reset_mask": over})
            assert info["_episode_number"].tolist() == over.tolist()
        begins = over & (mode is not AutoresetMode.SAME_STEP)
        number = np.where(begins & info["_episode_number"], info["episode_number"], number)
        observation, reward, ended, cut, info = env.step(np.array([0, 3]))
        fresh = begins & (mode is AutoresetMode.NEXT_STEP)
        number = np.where(fresh, info["episode_number"], number)
        count, total = np.where(begins, 0, count), np.where(begins, 0.0, total)
        count, total = count + ~fresh, total + reward
        over = ended | cut
        for row in np.flatnonzero(over):
            last = observation[row]
            if mode is AutoresetMode.SAME_STEP:
                last = info["final_obs"][row]
                assert info["final_info"]["outcome"][row] == "timeout"
            entry = (number[row], count[row], total[row], last.tobytes())
            ends.append(entry)
            if mode is AutoresetMode.SAME_STEP:
                number[row], count[row], total[row] = info["episode_number"][row], 0, 0.0
    return ends


def test_a_masked_reset_leaves_the_other_rows_alone() -> None:
    def rows(resets: bool) -> list[bytes]:
        env = vector(2, autoreset_mode="DISABLED", name="Noisy")
        observation, _ = env.reset(seed=5)
        seen = [observation[0].tobytes()]
        for step, action in enumerate(script(20)):
            if resets and step in (4, 5, 11):
                observation, _ = env.reset(options={"reset_mask": np.array([False, True])})
                assert observation[0].tobytes() == seen[-1]
            observation, *_ = env.step(np.array([action, 0]))
            seen.append(observation[0].tobytes())
        return seen

    assert rows(resets=True) == rows(resets=False)


def test_seeds_of_a_list_are_those_of_the_rows() -> None:
    _, info = vector(3, "Flat").reset(seed=[4, None, 4])
    assert info["seed"][[0, 2]].tolist() == [4, 4]
    assert info["seed"][1] >= 2**32  # by chance
    assert info["episode_number"].tolist() == [0, 1, 0]


def test_constants_are_drawn_for_each_episode_within_their_ranges() -> None:
    ranges = {"sensor_offset": (20.0, 60.0), "leg_friction": (0.5, 1.5)}
    plain, other = single("Flat", interface={"felt": "counts"}), None
    other = single("Flat", interface={"felt": "counts"}, randomise=ranges)
    offsets, frictions = [], []
    for number in range(6):
        there, here = (
            e.reset(seed=1, options={"episode_number": number})[0] for e in (other, plain)
        )
        again = other.reset(seed=1, options={"episode_number": number})[0]
        assert np.array_equal(again, there)
        offsets.append(4095.0 * (there - here)[0])
        frictions.append(other.world.robot.leg_friction)
    assert all(19.0 <= offset <= 61.0 for offset in offsets)
    assert all(0.3 <= friction <= 0.9 for friction in frictions)
    assert len({round(x, 1) for x in offsets}) == len(set(frictions)) == 6


# what is refused


@pytest.mark.parametrize(
    ("values", "word"),
    [
        ({"scene": "nowhere"}, "expected one of"),
        ({"action": "wings"}, "maneuver"),
        ({"interface": {"histroy": 3}}, "history"),
        ({"randomise": {"noise": (2.0, 1.0)}}, "noise must rise"),
        ({"control": {"rate": 333.0}}, "control.rate"),
        ({"robot": {"antennae": {"kind": "none"}}}, "a robot with antennae"),
        ({"readings": "yoked"}, "readings"),
        ({"interface": {"frequency": (0.3, 0.5)}}, "interface.frequency: .* 'maneuver'"),
        ({"interface": {"action": "joints", "turn_offset": 0.3}}, "turn_offset: .* 'joints'"),
        ({"control": {"search": {"patience": 9.0}}}, "control.search.patience: .* do not read"),
        ({"action": "gait", "control": {"gait": {"frequency": 0.5}}}, "gait.frequency: .* 'gait'"),
    ],
)
def test_values_that_cannot_be_used_are_refused_in_one_line(values: Any, word: str) -> None:
    with pytest.raises(ConfigError, match=word) as caught:
        envs.AntennaEnv(**values)
    assert "\n" not in str(caught.value)


def test_actions_seeds_and_masks_are_looked_at() -> None:
    env = vector(2, "Flat", autoreset_mode="DISABLED")
    with pytest.raises(ResetNeeded):
        env.step(np.zeros(2, np.int64))
    env.reset(seed=1)
    for action in (np.zeros(3, np.int64), np.array([0, 4]), np.array([0.5, 0.0]), [0, [1]]):
        with pytest.raises(ConfigError, match="action: expected"):
            env.step(action)
    for mask in ([True], [False, False], [1, 0]):
        with pytest.raises(ConfigError, match="reset_mask: expected 2 booleans"):
            env.reset(options={"reset_mask": np.array(mask)})
    for seed in (-1, True, 2**63):
        with pytest.raises(ConfigError, match="seed: expected a whole number of 0 to 4611686"):
            env.reset(seed=seed)
    with pytest.raises(ConfigError, match="autoreset_mode: expected one of"):
        vector(2, "Flat", autoreset_mode="NEXTSTEP")


def test_servos_tell_how_far_each_joint_is_from_its_goal() -> None:
    """The angles of the engine, about the zeros of the servos, less what was told last."""
    env = single("Flat", interface={"servos": True})
    table = observations(PolicyInterface(servos=True), ControlParams(), RobotSpec())
    names = [q.name for q in table]
    first, _ = env.reset(seed=1)
    now = slice(names.index("lag yaw1"), names.index("lag yaw1 mean"))
    assert np.abs(first[now]).max() == 0.0
    observation, *_ = env.step(0)
    world = env.world
    lag = world.drives() - world.data.ctrl[world.places.drives]
    assert observation[now] == pytest.approx(lag, abs=1e-5)
    assert np.abs(lag).max() > 0.01


def test_wrappers_of_vectors_take_it() -> None:
    env = gym.wrappers.vector.RecordEpisodeStatistics(vector(2, **SHORT))
    env = gym.wrappers.vector.NormalizeObservation(env)
    env.reset(seed=1)
    returns: list[float] = []
    for _ in range(24):
        *_, infos = env.step(np.zeros(2, np.int64))
        returns += infos["episode"]["r"][infos["_episode"]].tolist() if "episode" in infos else []
    assert len(returns) == 4


def test_without_a_seed_episodes_are_of_a_seed_of_chance() -> None:
    seeds = [vector(2, "Flat").reset()[1]["seed"].tolist() for _ in range(2)]
    seeds.append([single("Flat").reset()[1]["seed"]] * 2)
    assert all(a == b and a >= 2**32 for a, b in seeds)
    assert len({a for a, _ in seeds}) == 3


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"render_mode": "human"}, "as environments draw nothing, found 'human'"),
        ({"seed": 5}, r"expected the seed in reset\(seed=\.\.\.\)"),
    ],
)
def test_what_would_be_ignored_is_refused(given, said):
    for make in (envs.AntennaEnv, envs.AntennaVectorEnv):
        with pytest.raises(ConfigError, match=said):
            make(scene="flat", **given)


def test_a_first_seed_is_that_of_rows_that_are_not_reset_with_it_too():
    vector = gym.make_vec("antennate/Flat-v1", num_envs=3)
    vector.reset(seed=77, options={"reset_mask": np.array([True, False, False])})
    *_, info = vector.step(vector.action_space.sample())
    assert info["seed"].tolist() == [77] * 3
    assert info["episode_number"].tolist() == [0, 1, 2]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ({"seed": 1.5}, "seed: expected a whole number, or 2 of them, found 1.5"),
        ({"seed": "ab"}, "seed: expected a whole number, or 2 of them, found 'ab'"),
        ({"seed": np.array(4)}, "seed: expected a whole number, or 2 of them, found "),
        ({"seed": [1, 2, 3]}, "seed: expected 2 of them, found 3"),
        ({"seed": [1, [2]]}, "seed: expected a whole number of 0 to 4611686018427387904, found "),
        ({"seed": {1, 2}}, "seed: expected a whole number, or 2 of them, found "),
        ({"seed": [1, -2]}, "seed: expected a whole number of 0 to 4611686018427387904, found -2"),
        ({"options": {"episode_number": [1, 2, 3]}}, "episode_number: expected 2 of them, found 3"),
        ({"options": {"episode_number": [0, [1]]}}, "episode_number: expected a whole number of"),
        ({"options": {"episode_number": 0.5}}, "episode_number: expected a whole number of 0"),
        (
            {"options": {"mask": [True, True]}},
            "expected reset_mask or episode_number, found 'mask'",
        ),
        ({"options": 5}, "options: expected values by name, found 5"),
    ],
)
def test_what_is_no_seed_or_episode_is_refused(words, said):
    vector = envs.AntennaVectorEnv(num_envs=2, scene="flat")
    with pytest.raises(ConfigError, match=said):
        vector.reset(**words)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"episode": 3}, "options: expected episode_number, found 'episode'"),
        ("ab", "options: expected values by name, found 'ab'"),
    ],
)
def test_an_unknown_option_of_a_reset_is_refused(options, said):
    with pytest.raises(ConfigError, match=said):
        envs.AntennaEnv(scene="flat").reset(seed=1, options=options)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ({"num_envs": 0}, "num_envs: expected at least 1, found 0"),
        (
            {"num_envs": 2.5},
            "num_envs: expected a whole number of 0 to 4611686018427387904, found 2.5",
        ),
        ({"action": "gait", "interface": None}, "interface: expected values by name, found None"),
        (
            {"action": "gait", "interface": {"action": "joints"}},
            "action: expected one, found 'gait' and in interface 'joints'",
        ),
    ],
)
def test_a_vector_of_no_whole_number_of_robots_or_no_interface_is_refused(words, said):
    with pytest.raises(ConfigError, match=said):
        envs.AntennaVectorEnv(scene="flat", **words)


# copies


@pytest.mark.parametrize("kind", ["make", "make_vec"])
def test_an_environment_that_has_begun_refuses_to_be_copied_in_one_line(kind: str) -> None:
    """`copy.copy` gave one that shared the simulation, the others an error of memoryviews."""
    env = getattr(gym, kind)("antennate/Flat-v1").unwrapped
    env.reset(seed=3)
    for act in (copy.copy, copy.deepcopy, pickle.dumps):
        with pytest.raises(BadInputError, match=r"expected no copy .*gymnasium\.make.*reset") as no:
            act(env)
        assert "\n" not in str(no.value)
        assert isinstance(no.value, TypeError)  # as of all that cannot be pickled
    env.step(env.action_space.sample())


@pytest.mark.parametrize("act", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_an_environment_that_has_not_begun_is_copied_whole(act: Any) -> None:
    env = gym.make("antennate/Flat-v1").unwrapped
    other = act(env)
    with pytest.raises(BadInputError, match="expected no copy"):
        copy.copy(env)
    first, again = env.reset(seed=3)[0], other.reset(seed=3)[0]
    assert np.array_equal(first, again)
    moved = [env.step(0)[0] for _ in range(3)][-1]
    assert not np.array_equal(moved, other.step(0)[0])
    assert np.array_equal(moved, [other.step(0)[0] for _ in range(2)][-1])
