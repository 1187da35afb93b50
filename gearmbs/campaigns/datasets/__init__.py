"""Labelled data sets from campaigns: signals, sensors, splits without leaks, cards, a baseline."""

from typing import TYPE_CHECKING

from gearmbs._lazy import late

if TYPE_CHECKING:
    from gearmbs.campaigns.datasets.baseline import (
        Score,
        classifier,
        features,
        from_simulation_to_recordings,
        leak_and_no_leak,
        macro_auroc,
        recording_features,
        score,
    )
    from gearmbs.campaigns.datasets.layers import (
        SensorLayers,
        one_state_a_group,
        random_split,
        shared_groups,
        split_by_group,
        withhold,
    )
    from gearmbs.campaigns.datasets.make import data_set_plan, feature_table, write_data_set

__all__ = [
    "Score",
    "SensorLayers",
    "classifier",
    "data_set_plan",
    "feature_table",
    "features",
    "from_simulation_to_recordings",
    "leak_and_no_leak",
    "macro_auroc",
    "one_state_a_group",
    "random_split",
    "recording_features",
    "score",
    "shared_groups",
    "split_by_group",
    "withhold",
    "write_data_set",
]

late(
    __name__,
    {
        "Score": ".baseline",
        "SensorLayers": ".layers",
        "classifier": ".baseline",
        "data_set_plan": ".make",
        "feature_table": ".make",
        "features": ".baseline:features",
        "from_simulation_to_recordings": ".baseline",
        "leak_and_no_leak": ".baseline",
        "macro_auroc": ".baseline",
        "one_state_a_group": ".layers",
        "random_split": ".layers",
        "recording_features": ".baseline",
        "score": ".baseline",
        "shared_groups": ".layers",
        "split_by_group": ".layers",
        "withhold": ".layers",
        "write_data_set": ".make",
    },
)
