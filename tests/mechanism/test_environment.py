"""The page of the environment for control: what it prints holds, and its class is one of Gymnasium."""

import warnings
from pathlib import Path

import numpy as np
import pytest

from tests.docs.support import blocks

PAGE = Path(__file__).parents[2] / "docs" / "notebooks" / "environment.md"


@pytest.mark.slow
def test_the_environment_balances_its_pole(capsys):
    """The page's policy, made of the linear plant, keeps the pole up for whole episodes; without it the pole falls."""
    exec("\n".join(block.code for block in blocks(PAGE) if block.language == "code-cell"), {})
    told = capsys.readouterr().out.splitlines()
    assert [line.split()[-1] for line in told[:3]] == ["balanced"] * 3
    assert told[4].startswith("fallen")


@pytest.mark.slow
def test_the_environment_is_one_of_gymnasium():
    """The page's class passes their check, in their wrappers and several at a time; a seed makes the episode."""
    gymnasium = pytest.importorskip("gymnasium")
    from gymnasium.utils.env_checker import check_env

    known = {}
    for block in blocks(PAGE):
        if block.language == "code-block" or "class" in block.code or "def cart_pole" in block.code:
            exec(block.code, known)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(known["BalanceEnv"](), skip_render_check=True)
    one = gymnasium.make("gearmbs/Balance-v0", max_episode_steps=3)
    two = gymnasium.vector.SyncVectorEnv([known["BalanceEnv"]] * 2)
    seen, _ = one.reset(seed=7)
    np.testing.assert_array_equal(two.reset(seed=[7, 8])[0][0], seen)
    for k in range(3):
        seen, _, fallen, over, _ = one.step(np.array([1.0], dtype=np.float32))
        both = two.step(np.ones((2, 1), dtype=np.float32))[0]
        np.testing.assert_array_equal(both[0], seen)
        assert (fallen, over) == (False, k == 2)
    # without a seed the random numbers go on
    assert not np.array_equal(one.reset()[0], one.reset()[0])
