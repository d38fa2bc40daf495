"""Tasks, their scripted policy, and their interfaces to libraries of reinforcement learning."""
import numpy as np
import pytest

from flash_sim import folds, tasks
from flash_sim.tasks import FoldSettings, FoldTask, FoldTeacher

SHORT = {"steps_per_action": 1, "time_limit": 3}


def fold(task, teacher, disturb=lambda step, actions: None):
    """Whether each environment was folded, within the time limit."""
    folded = np.zeros(task.n_envs, bool)
    for step in range(task.time_limit):
        actions = teacher.act(task)
        disturb(step, actions)
        folded |= task.step(actions)[2]
        if folded.all():
            break
    return folded


def test_the_teacher_folds_the_towel_from_random_starts_and_materials():
    task = FoldTask(8, FoldSettings(randomization="published", seed=5))
    starts = task.take[:, 0]
    assert np.ptp(starts, axis=0)[:2].min() > 0.05  # they differ
    assert fold(task, FoldTeacher(task)).all()
    assert np.linalg.norm(task.take - task.lay, axis=2).max() < 0.06
    assert np.linalg.norm(task.take[:, 0] - starts, axis=1).min() > 0.2


def test_two_hands_carry_together():
    task = FoldTask(4, FoldSettings("towel_two_arms", randomization="published", seed=3))
    assert task.actions == 8 and task.observe().shape == (4, 28)
    heights = []

    def watch(step, actions):
        if task.carries.all():
            heights.append(task.take[:, :, 2].copy())

    assert fold(task, FoldTeacher(task), watch).all()
    assert np.abs(np.diff(heights, axis=2)).max() < 0.03  # of the corners, all the way
    assert np.max(heights) > 0.08


def test_stages_follow_each_other():
    corners = {"a": (0, 1), "b": (1, 1)}
    there_and_back = folds.Fold(folds.FOLDS["towel"].scene, tuple(
        (folds.Carry(hand, corner, (corner[0], 0)),) for hand, corner in corners.items()))
    task = FoldTask(2, FoldSettings(there_and_back, seed=4))
    assert task.observe().shape == (2, 30) and task.works.tolist() == [[True, False]] * 2
    assert (task.observe()[:, 17:26] == 0).all()  # of the hand that waits
    seen = []
    assert fold(task, FoldTeacher(task), lambda step, actions: seen.append(task.observe()[:, -2:])).all()
    assert (seen[0] == [1, 0]).all() and (seen[-1] == [0, 1]).all(axis=1).any()


def test_the_teacher_lifts_the_corner_and_holds_it():
    task = FoldTask(8, FoldSettings("lift", randomization="published", seed=5))
    starts = task.take[:, 0]
    assert fold(task, FoldTeacher(task)).all()
    assert task.carries.all()
    assert np.abs(task.take[:, 0] - starts - [0, 0, 0.2]).max() < 0.05


def test_a_lift_is_done_where_it_is_held_at_rest():
    """The corner goes by its height, and falls through it, without being there."""
    task = FoldTask(2, FoldSettings("lift", seed=1))
    teacher = FoldTeacher(task)
    while not (teacher.state == tasks.TRANSPORT).all():
        task.step(teacher.act(task))
    up, stay = np.array([[0, 0, 1, 1.0]] * 2), np.array([[0, 0, 0, 1.0]] * 2)
    heights = []
    while task.take[:, 0, 2].max() < 0.3:
        rewards, success = task.step(up)[1:3]
        heights += [task.take[:, 0, 2]]
        off_goal, off_hand = np.linalg.norm([task.lay - task.take, task.place - task.take], axis=3)[:, :, 0]
        assert not success.any() and np.allclose(rewards, -off_goal - 0.2 * off_hand - 0.006)
    assert np.abs(np.array(heights) - 0.2).min(axis=0).max() < 0.02
    for _ in range(30):
        assert not task.step(stay - [0, 0, 0, 2])[2].any()  # let go
    assert task.take[:, 0, 2].max() < 0.1
    assert fold(task, teacher).all()  # and taken again: above where it lay at first, not where it fell
    assert np.linalg.norm(task.lay - task.take, axis=2).max() < task.settings.near
    rewards, success = task.step(stay)[1:3]
    assert success.all() and (rewards > 1.9).all()


def test_a_lift_may_precede_a_fold():
    corner = (0, 1)
    stages = (folds.Lift("hand", corner, 0.1),), (folds.Carry("hand", corner, (1, 0)),)
    task = FoldTask(2, FoldSettings(folds.Fold(folds.FOLDS["lift"].scene, stages), seed=4))
    assert task.holds.all()
    assert fold(task, FoldTeacher(task)).all()
    assert not task.holds.any() and not task.carries.any()


def test_unknown_folds_are_refused():
    with pytest.raises(ValueError, match="fold: found 'sock', expected one of towel, towel_two_arms, tshirt"):
        FoldTask(1, FoldSettings("sock"))


def test_masks_choose_what_is_reset():
    task = FoldTask(2, FoldSettings(**SHORT))
    task.step(np.zeros((2, 4)))
    task.reset(np.array([True, False]))
    assert task.lengths.tolist() == [0, 1]
    for wrong in ([True], [0.7], "a", [2], [0, 0]):
        with pytest.raises((TypeError, ValueError), match="reset: env_ids: found"):
            task.reset(wrong)


def test_folds_that_are_none_are_refused():
    carry, other = folds.Carry("a", (0, 1), (1, 0)), folds.Carry("b", (1, 1), (0, 0))
    for make in (lambda: folds.Carry("a", (-5, 0), (1, 1)), lambda: folds.Carry("a", (0, float("nan")), (1, 1)),
                 lambda: folds.Carry("a", (0, 1), (0, 1)), lambda: folds.Carry(3, (0, 1), (1, 1)),
                 lambda: folds.Carry("a", (0, 1, 0), (1, 1)), lambda: folds.Fold("s", ()), lambda: folds.Fold("s", ((),)),
                 lambda: folds.Lift("a", (0, 2), 0.1), lambda: folds.Lift("", (0, 1), 0.1), lambda: folds.Lift("a", (0, 1), 0),
                 lambda: folds.Lift("a", (0, 1), float("nan")), lambda: folds.Lift("a", (0, 1), "high"),
                 lambda: folds.Fold("s", ((carry, folds.Lift("b", (0, 1), 0.1)),)),
                 lambda: folds.Fold("s", (carry,)), lambda: folds.Fold("s", ((carry, folds.Carry("a", (1, 1), (0, 0))),)),
                 lambda: folds.Fold("s", ((carry, folds.Carry("b", (0, 1), (0, 0))),)),
                 lambda: FoldSettings(steps_per_action=-1), lambda: FoldSettings(speed=-1), lambda: FoldSettings(near=float("nan")),
                 lambda: FoldSettings(shift=1e6), lambda: FoldSettings(time_limit=0), lambda: FoldTask(2, "towel"),
                 lambda: FoldTeacher(None)):
        with pytest.raises((TypeError, ValueError), match="(Carry|Lift|Fold|FoldSettings|FoldTask|FoldTeacher): .*found"):
            make()
    assert folds.Fold("s", ((carry, other),)).hands == ["a", "b"]


def test_what_drops_the_corner_takes_it_again():
    task = FoldTask(2, FoldSettings(seed=1))
    teacher = FoldTeacher(task)
    dropped = []

    def disturb(step, actions):
        if not dropped and (teacher.state == tasks.TRANSPORT).all() and (task.take[:, 0, 2] > 0.08).all():
            dropped.append(step)
            actions[0, 3] = -1

    assert fold(task, teacher, disturb).all() and dropped


def test_the_same_seed_is_the_same_episode():
    runs = []
    for _ in range(2):
        task = FoldTask(3, FoldSettings(randomization="published", seed=2, **SHORT))
        runs.append([task.step(np.full((3, 4), 0.3))[0] for _ in range(3)])
    assert np.array_equal(*runs)
    first = task.reset(seed=7)
    assert np.array_equal(first, task.reset(seed=7)) and not np.array_equal(first, task.reset(seed=8))
    other = task.reset([1])
    assert np.array_equal(other[[0, 2]], task.observe()[[0, 2]])


def test_bad_actions_are_refused():
    task = FoldTask(2, FoldSettings(**SHORT))
    for actions in (np.zeros((2, 3)), np.full((2, 4), np.nan), np.zeros(4)):
        with pytest.raises(ValueError, match="actions: found"):
            task.step(actions)


def test_gymnasium_sees_the_end_of_an_episode_and_the_start_of_the_next():
    gymnasium = pytest.importorskip("gymnasium")
    from flash_sim.gym import FoldVectorEnv
    env = FoldVectorEnv(3, FoldSettings(**SHORT))
    assert env.metadata["autoreset_mode"] == gymnasium.vector.AutoresetMode.SAME_STEP
    observations, infos = env.reset(seed=3)
    assert env.observation_space.contains(observations) and infos == {}
    env.task.lengths[1] = 1  # this one ends first
    env.action_space.seed(0)
    for step in range(3):
        last, (observations, rewards, terminated, truncated, infos) = observations, env.step(env.action_space.sample())
        assert env.observation_space.contains(observations) and rewards.shape == (3,) and not terminated.any()
        assert truncated.tolist() == [[False] * 3, [False, True, False], [True, False, True]][step]
        if truncated.any():
            assert np.array_equal(infos["_final_obs"], truncated)
            assert np.array_equal(infos["final_obs"][~truncated], observations[~truncated])
            moved = np.abs(infos["final_obs"] - last)[:, :3].max(axis=1)
            assert (moved < 0.01).all() and (observations[truncated][:, 2] == 0.15).all()  # the hand is back
    env.close()


def test_gymnasium_may_reset_itself():
    pytest.importorskip("gymnasium")
    from flash_sim.gym import FoldVectorEnv
    env = FoldVectorEnv(2, FoldSettings(**SHORT), autoreset=False)
    for _ in range(3):
        *_, truncated, infos = env.step(np.zeros((2, 4)))
    assert truncated.all() and "final_obs" not in infos
    env.reset(options={"reset_mask": np.array([True, False])})
    assert env.task.lengths.tolist() == [0, 3]


def test_rsl_rl_trains_on_it():
    """Two rounds of PPO: the interface is what its runner asks for."""
    torch = pytest.importorskip("torch")
    runners = pytest.importorskip("rsl_rl.runners")
    from flash_sim.rsl import FoldVecEnv
    env = FoldVecEnv(2, FoldSettings(**SHORT))
    observations = env.get_observations()
    assert observations["policy"].shape == (2, 14) and observations["policy"].dtype == torch.float32
    env.episode_length_buf = torch.tensor([2, 0])
    observations, rewards, dones, extras = env.step(torch.zeros(2, 4))
    assert dones.tolist() == [1, 0] and extras["time_outs"].tolist() == [True, False] and rewards.shape == (2,)
    assert env.episode_length_buf.tolist() == [0, 1]
    model = {"class_name": "MLPModel", "hidden_dims": [8], "activation": "elu"}
    runner = runners.OnPolicyRunner(env, {
        "num_steps_per_env": 4, "save_interval": 100, "obs_groups": {"actor": ["policy"], "critic": ["policy"]},
        "actor": model | {"distribution_cfg": {"class_name": "GaussianDistribution", "init_std": 1.0}}, "critic": model,
        "algorithm": {"class_name": "PPO", "num_learning_epochs": 1, "num_mini_batches": 1}}, log_dir=None, device="cpu")
    runner.learn(2, init_at_random_ep_len=True)
