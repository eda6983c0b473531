"""Tables on cost and speed that are computed from records."""

import pandas as pd
from tables import Store, derived

SMALL, MEDIUM, LARGE, MILLION = 1_422, 10_000, 100_000, 1_000_000
PHASES = ("filling", "drag")


@derived("costs/options")
def _options(store: Store) -> pd.DataFrame:
    """Cost of each option with its group and the words of the pages."""
    both = [store.table("tradeoff/costs"), store.table("motion/costs/costs")]
    return store.table("costs/labels").merge(pd.concat(both), on="name", validate="one_to_one")


@derived("costs/summary")
def _summary(store: Store) -> pd.DataFrame:
    """Ratios of the costs of two options."""
    costs = store.table("tradeoff/costs").set_index("name")
    values = store.table("costs/values").set_index("name")["value"]
    plain = costs.per_second["plain_full"] / costs.per_second["full"]
    even = costs.per_second["plain_even_facets"] / costs.per_second["plain"]
    steps = values["steps_of_revolution"]
    seconds = steps * values["cpu_us_per_step"] / 1e6 * costs.per_step["full"]
    return pd.DataFrame(
        {
            "plain_full_ratio": [plain],
            "timestep_ratio": [0.64 / 0.2],
            "even_facets_ratio": [plain * even],
            "steps": [steps],
            "revolution_min": [seconds * costs.wall_ratio["two_ranks"] / 60],
        }
    )


@derived("benchmarks/chains_ranges")
def _chain_ranges(store: Store) -> pd.DataFrame:
    """Lowest and highest rate of each step over both networks and all sizes."""
    end = "_mcontacts_per_s"
    rates = store.table("benchmarks/chains_rates").filter(like=end)
    rates.columns = rates.columns.str.removesuffix(end)
    return (
        pd.DataFrame({"lowest": rates.min(), "highest": rates.max()})
        .rename_axis("step")
        .reset_index()
    )


@derived("benchmarks/chains_largest")
def _chains_largest(store: Store) -> pd.DataFrame:
    """Smallest and largest network of each kind."""
    rates = store.table("benchmarks/chains_rates")
    return rates.groupby("network")["n_contacts"].agg(["min", "max"]).reset_index()


@derived("benchmarks/pilot_whole")
def _pilot_whole(store: Store) -> pd.DataFrame:
    """CPU time of LIGGGHTS and of the analysis of each bowl."""
    runs = store.table("benchmarks/pilot_runs")
    analysis = store.table("benchmarks/pilot_analysis")["cpu_s"].to_numpy().reshape(-1, len(runs))
    cost = sum(
        runs[f"{phase}_steps"] * runs[f"{phase}_cpu_ns_per_particle_step"] for phase in PHASES
    )
    cpu_s = cost * runs.n_particles / 1e9
    return runs.assign(
        liggghts_cpu_s=cpu_s,
        liggghts_cpu_min=cpu_s / 60,
        analysis_cpu_s=analysis.sum(axis=0),
        analysis_fraction=analysis.sum(axis=0) / cpu_s,
    )


@derived("benchmarks/pilot_growth")
def _pilot_growth(store: Store) -> pd.DataFrame:
    """Cost of a particle and step in larger bowls relative to smaller ones."""
    ranks, runs = store.table("benchmarks/pilot_ranks"), store.table("benchmarks/pilot_runs")
    small, medium, large = ranks.one_rank_ns
    values = store.table("benchmarks/scale_values").set_index("name")["value"]
    return pd.DataFrame(
        {
            "large_to_small": [large / small],
            **{
                phase: runs[f"{phase}_cpu_ns_per_particle_step"].iloc[[-1]].to_numpy()
                / runs[f"{phase}_cpu_ns_per_particle_step"].iloc[0]
                for phase in ("filling", "drag")
            },
            "large_to_medium": [large / medium],
            "side_by_side": [1 / ranks.cpu_ratio.iloc[0]],
            "fall_to_rest": [values["fall"] / values["rest"]],
        }
    )


@derived("benchmarks/million")
def _million(store: Store) -> pd.DataFrame:
    """Estimate for a million particles: lower and, where there is one, upper limit."""
    run = store.table("benchmarks/pilot_runs").iloc[-1]
    growth = float(store.table("benchmarks/pilot_growth").large_to_medium.iloc[0])
    values = store.table("benchmarks/scale_values").set_index("name")["value"]
    ranks = store.table("benchmarks/pilot_ranks")["one_rank_mb"].to_list()
    analysis = store.table("benchmarks/pilot_analysis")

    def hours(steps: float, ns: float) -> float:
        return MILLION * steps * ns * 1e-9 / 3600

    def line(at: int, small: float, large: float) -> float:
        return large + (MILLION - LARGE) * (large - small) / (LARGE - at)

    def analysed(command: str, what: str) -> float:
        return line(MEDIUM, *analysis.loc[analysis.command == command, what].to_list()[1:])

    revolution = hours(values["revolution_steps"], run.drag_cpu_ns_per_particle_step)
    raw, parquet = run.raw_bytes_per_particle_frame, values["parquet_bytes"]
    frames = values["revolution_frames"]
    core_hours = {
        "filling": hours(run.filling_steps, run.filling_cpu_ns_per_particle_step),
        "drag of the same arc": hours(run.drag_steps, run.drag_cpu_ns_per_particle_step),
        "one revolution": revolution,
    }
    rows = [(what, low, low * growth, "core hours") for what, low in core_hours.items()]
    stiff = revolution * 100 / 1000
    what = "one revolution at the physical Young's modulus, time step x 0.01"
    rows.append((what, stiff, stiff * growth, "thousand core hours"))
    sizes = {
        "memory of LIGGGHTS, one rank": (line(SMALL, ranks[0], ranks[-1]) / 1e3, "GB"),
        "network frame, raw": (raw, "MB"),
        "network frame, Parquet": (parquet, "MB"),
        "network frames of one revolution at 20 Hz, raw": (raw * frames / 1e3, "GB"),
        "network frames of one revolution at 20 Hz, Parquet": (parquet * frames / 1e3, "GB"),
        "restart file": (values["restart_bytes"], "MB"),
        "tables of 13 frames, CPU time": (analysed("tables", "cpu_s"), "s"),
        "tables of 13 frames, memory": (analysed("tables", "peak_mb") / 1e3, "GB"),
        "chains of 7 frames, CPU time": (analysed("chains", "cpu_s"), "s"),
        "chains of 7 frames, memory": (analysed("chains", "peak_mb") / 1e3, "GB"),
    }
    rows += [(what, amount, None, unit) for what, (amount, unit) in sizes.items()]
    return pd.DataFrame(rows, columns=["what", "lowest", "highest", "unit"])
