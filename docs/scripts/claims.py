"""How the three claims depend on what the paper left open: the study of ``docs/data/claims.toml`` and its figures.

``python docs/scripts/claims.py out/claims.campaign`` carries the study out, which may be interrupted and taken up
again, and writes ``docs/data/claims.parquet`` (settings and the ratios that decide) and ``docs/data/claims.json`` (what
it took). The documentation reads these two and simulates nothing.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from gearmbs.campaigns import Campaign, PolynomialChaos, fit_chaos, load_plan, total_bounds
from gearmbs.campaigns.codes import known_code
from gearmbs.campaigns.sobol_bounds import first_indices, probability
from gearmbs.files import whole_file, write_whole
from gearmbs.signals import COMPONENTS
from gearmbs.studies.presets.paper_cases import MUCH
from gearmbs.view.figures.style import new_figure

DATA = Path(__file__).parent.parent / "data"
PLAN = DATA / "claims.toml"
SETTINGS = {
    "depth": ("penetration of full damping, mm", 1e3),
    "damping": ("damping C, N s/mm", 1e-3),
    "stiffness": ("stiffness K, N/mm^e", 1.0),
    "exponent": ("exponent e", 1.0),
    "friction": ("static friction", 1.0),
    "backlash": ("backlash, mm", 1e3),
    "plane": ("plane", 1.0),
    "speed": ("speed, rpm", 30.0 / np.pi),
    "face_width": ("face width, mm", 1e3),
    "shaft_radius": ("shaft radius (inertia), mm", 1e3),
}
"""Label and factor from SI."""

RATIOS = ("misaligned", "distance", "load", "load_each")
LEAST = {"misaligned": 1.0, "distance": 1.0, "load": MUCH, "load_each": MUCH}
NAMES = {
    "misaligned": "misalignment raises 2 x GMF",
    "distance": "+3 mm raises 1-3 x GMF",
    "load": f"low load smaller by {MUCH:g}",
    "all": "all three",
}
COLOURS = dict(zip(NAMES, ("#1b6ca8", "#d1781e", "#5d8a3a", "#222222")))
BITS = 12
"""Of what is stored: numbers are right to 0.02 %."""


def store(campaign: Campaign) -> None:
    """Write what the page needs of a campaign, finished or not."""
    table = campaign.table
    table = table[table["status"] == "done"]
    kept = {name: table[name] for name in SETTINGS}
    kept |= {f"{ratio}.{c}": table[f"{ratio}.{c}"] for ratio in RATIOS for c in COMPONENTS}
    data = pd.DataFrame({"index": table["index"].astype("int32"), **kept})
    numbers = [name for name in data.columns if data[name].dtype == float]
    for name in numbers:
        data[name] = shortened(data[name].to_numpy())
    with whole_file(DATA / "claims.parquet") as part:
        data.to_parquet(part, index=False, compression="zstd", use_dictionary=["plane"], use_byte_stream_split=numbers)
    status = campaign.status()
    ledger = campaign.folder.entry(campaign.folder.done()[0])
    code = known_code(campaign.folder, ledger["code"])
    setting = {} if code is None else code.setting
    facts = {
        "planned": status.cases,
        "done": status.done,
        "failed": status.failed,
        "processor_hours": round(status.processor_seconds / 3600.0, 2),
        "processor": setting.get("processor", "unknown"),
        "versions": {"gearmbs": ledger["gearmbs"]}
        | {name: setting[name].split()[0] for name in ("numpy", "scipy", "numba") if name in setting},
    }
    facts["bounds"] = {ratio: bounds(data, ratio) for ratio in LEAST if ratio != "load_each"}
    write_whole(DATA / "claims.json", json.dumps(facts, indent=1) + "\n")


def bounds(data: pd.DataFrame, ratio: str, component: str = "line_of_action") -> dict:
    """Return between which values the total indices of the logarithm of a ratio lie."""
    levels = [2 if name == "plane" else 0 for name in SETTINGS]
    values = np.log(data[f"{ratio}.{component}"].to_numpy(dtype=float))
    found = total_bounds(points(data), values, list(SETTINGS), levels=levels)
    columns = {c: np.round(getattr(found, c), 4).tolist() for c in ("low", "high", "sure_low", "sure_high")}
    return {"explained": round(found.q_squared, 4), **columns}


def shortened(values: np.ndarray) -> np.ndarray:
    """Return numbers in single precision with `BITS` bits after the first, which a compressor makes small."""
    bits = values.astype("float32").view("int32")
    rest = 23 - BITS
    return (((bits + (1 << (rest - 1))) >> rest) << rest).view("float32")


def load() -> pd.DataFrame:
    """Return settings and ratios, one row a point."""
    return pd.read_parquet(DATA / "claims.parquet")


def facts() -> dict:
    """Return what the study took."""
    return json.loads((DATA / "claims.json").read_text())


def held(data: pd.DataFrame, component: str = "line_of_action", load: str = "load") -> pd.DataFrame:
    """Return for each point whether each claim holds, and all three; ``load`` names the scaling rule of the third."""
    found = {}
    for claim in ("misaligned", "distance", "load"):
        name = load if claim == "load" else claim
        ratio, least = data[f"{name}.{component}"], LEAST[name]
        found[claim] = ratio >= least if claim == "load" else ratio > least
    return pd.DataFrame(found | {"all": found["misaligned"] & found["distance"] & found["load"]})


def probabilities(data: pd.DataFrame) -> pd.DataFrame:
    """Return in which part of the points each claim holds, in percent with 95 % intervals, by component and scaling."""
    rows = {}
    for component in COMPONENTS:
        for rule, name in (("load", "one scale for all"), ("load_each", "each load in its own scale")):
            verdicts = held(data, component, rule)
            rows[component.replace("_", " "), name] = {NAMES[c]: _percent(verdicts[c]) for c in verdicts}
    table = pd.DataFrame.from_dict(rows, orient="index")
    table.index.names = ["component", "scaling"]
    return table


def _percent(values: pd.Series) -> str:
    p, low, high = (100.0 * v for v in probability(values.to_numpy(dtype=float)))
    return f"{p:.1f} ({low:.1f}-{high:.1f})"


def points(data: pd.DataFrame) -> np.ndarray:
    """Return the points in the unit cube."""
    return load_plan(PLAN).points(int(data["index"].max()) + 1)[data["index"].to_numpy()]


def chaos(data: pd.DataFrame, ratio: str, component: str = "line_of_action") -> PolynomialChaos:
    """Return the polynomial chaos of the logarithm of a ratio."""
    levels = [2 if name == "plane" else 0 for name in SETTINGS]
    values = np.log(data[f"{ratio}.{component}"].to_numpy(dtype=float))
    return fit_chaos(points(data), values, list(SETTINGS), levels=levels)


def deciding(data: pd.DataFrame, component: str = "line_of_action") -> pd.DataFrame:
    """Return first indices of the verdicts, in percent, and the level that chance reaches."""
    columns = {name: data[name].to_numpy() for name in SETTINGS}
    verdicts = held(data, component)
    found = {}
    for claim in verdicts:
        table = first_indices(columns, verdicts[claim].to_numpy(dtype=float)).reindex(list(SETTINGS))
        found[NAMES[claim]] = (100.0 * table["index"]).round(1)
        chance = 100.0 * table["chance"].max()
        found[NAMES[claim]]["chance"] = round(float(chance), 1)
    return pd.DataFrame(found)


def totals(data: pd.DataFrame, component: str = "line_of_action") -> pd.DataFrame:
    """Return first and total indices of the ratios' logarithms, in percent, and what the surrogates explain.

    ``within`` is where the total index of the ratio itself must lie, whatever the part is like that the surrogate does
    not explain; see `gearmbs.campaigns.sobol_bounds`.
    """
    found = {}
    for ratio in ("misaligned", "distance", "load"):
        fitted = chaos(data, ratio, component)
        table = fitted.table().reindex(list(SETTINGS))
        for kind in ("first", "total"):
            text = [f"{100 * v:.0f} ± {100 * c:.0f}" for v, c in zip(table[kind], table[f"{kind}_confidence"])]
            found[NAMES[ratio], kind] = [*text, f"{100 * fitted.q_squared:.0f}"]
        known = facts()["bounds"][ratio]
        ends = zip(known["sure_low"], known["sure_high"])
        explained = f"{100 * known['explained']:.0f}"
        found[NAMES[ratio], "within"] = [*(f"{100 * a:.0f} to {100 * b:.0f}" for a, b in ends), explained]
    return pd.DataFrame(found, index=[*SETTINGS, "explained of points left out"])


def curves(data: pd.DataFrame, component: str = "line_of_action", bins: int = 8) -> Figure:
    """Draw how probable each claim is over each setting, all others drawn from their ranges."""
    verdicts = held(data, component)
    figure = new_figure(11.0, 5.2)
    for k, (name, (label, factor)) in enumerate(SETTINGS.items()):
        ax = figure.add_subplot(2, 5, k + 1)
        column = data[name]
        texts = column.dtype.kind not in "fi"
        place = column.astype("category").cat.codes if texts else pd.qcut(column, bins, labels=False)
        middle = np.arange(column.nunique()) if texts else column.groupby(place).median().to_numpy() * factor
        for claim in NAMES:
            ends = np.array([probability(v.to_numpy(dtype=float)) for _, v in verdicts[claim].groupby(place)])
            ax.fill_between(middle, ends[:, 1], ends[:, 2], color=COLOURS[claim], alpha=0.15, lw=0)
            line = {"ls": "--"} if claim == "all" else {}
            ax.plot(middle, ends[:, 0], marker="o", ms=2.5, color=COLOURS[claim], label=NAMES[claim], **line)
        if texts:
            ax.set_xticks(middle, sorted(column.unique()))
        elif name in ("depth", "damping", "stiffness"):
            ax.set_xscale("log")
            ax.xaxis.set_minor_formatter(NullFormatter())
        ax.set_ylim(0.0, 1.0)
        ax.set_xlabel(label, fontsize=8)
        ax.tick_params(labelsize=7)
        if k % 5:
            ax.set_yticklabels([])
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside upper center", ncol=4, fontsize=8)
    return figure


def maps(data: pd.DataFrame, component: str = "line_of_action", along: str = "speed", bins: int = 7) -> Figure:
    """Draw in which part of the points each claim holds over penetration depth and another setting."""
    verdicts = held(data, component)
    x, y = data["depth"] * 1e3, data[along] * SETTINGS[along][1]
    edges = [np.quantile(v, np.linspace(0.0, 1.0, bins + 1)) for v in (x, y)]
    figure = new_figure(11.0, 3.0)
    axes = figure.subplots(1, 4, sharey=True)
    for ax, claim in zip(axes, NAMES):
        hits = np.histogram2d(x, y, edges, weights=verdicts[claim].astype(float))[0]
        counts = np.histogram2d(x, y, edges)[0]
        share = np.divide(hits, counts, out=np.full_like(hits, np.nan), where=counts > 0)
        mesh = ax.pcolormesh(*edges, share.T, cmap="viridis", vmin=0.0, vmax=1.0)
        ax.set_xscale("log")
        ax.xaxis.set_minor_formatter(NullFormatter())
        ax.set_xlabel("penetration of full damping, mm", fontsize=8)
        ax.set_title(NAMES[claim], fontsize=9)
    axes[0].set_ylabel(SETTINGS[along][0], fontsize=8)
    figure.colorbar(mesh, ax=axes, label="part of the points")
    return figure


def thresholds(data: pd.DataFrame) -> Figure:
    """Draw how probable the third claim is over what "much smaller" is taken to mean."""
    figure = new_figure(6.0, 3.2)
    ax = figure.subplots()
    least = np.linspace(0.5, 2.0, 151)
    for component in COMPONENTS:
        ratio = data[f"load.{component}"].to_numpy()
        ax.plot(least, [(ratio >= v).mean() for v in least], label=component.replace("_", " "))
    ax.axvline(MUCH, color="0.6", lw=1)
    ax.set_xlabel("least ratio of high to low load, over states and harmonics")
    ax.set_ylabel("part of the points")
    ax.legend(fontsize=8)
    return figure


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="of the campaign")
    parser.add_argument("--workers", type=int, default=None)
    parser.add_argument("--only-store", action="store_true", help="keep of the campaign what is done already")
    given = parser.parse_args()
    study = Campaign(given.folder) if given.only_store else Campaign(given.folder, load_plan(PLAN))
    if not given.only_store:
        study.run(given.workers, progress=True)
    store(study)
