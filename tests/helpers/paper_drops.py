"""Drops by the laws of free flight, whose restitution is known on paper."""

import math
from itertools import pairwise
from typing import Literal

import numpy as np

from dragchain.calibration.drops import Drop, DropPurpose, DropTestOfStudy
from dragchain.calibration.simulated_drops import DropRun, Drops, Waveform
from dragdeck.scenes.drop_test import DropFidelity

G, HEIGHT = 9.81, 0.010
FALL_S = math.sqrt(2 * HEIGHT / G)
Peaks = Literal["auto", "yes", "no"]
BIAS = 0.02
"""Made-up engine: it rebounds with the deck's value plus this times (1 - value)."""


def rebound(deck: float, bias: float) -> float:
    return deck + bias * (1 - deck)


def paper_drop(
    deck: float, *, bias: float = 0.0, height: float = HEIGHT, purpose: DropPurpose = "reference",
    contact_s: float = 25e-6, jitter: float = 0.0,
) -> DropRun:  # fmt: skip
    """A drop by the laws of free flight; contacts are sin^1.5, peaks go with v^1.2."""
    e = rebound(deck, bias) + jitter
    speeds = math.sqrt(2 * G * height) * e ** np.arange(4)
    down, impacts = math.sqrt(2 * height / G), []
    for before, after in pairwise(speeds):
        time = down + np.linspace(-0.1, 1.1, 601) * contact_s
        phase = np.clip((time - down) / contact_s, 0, 1)
        peak = 23.0 * float(before / speeds[0]) ** 1.2
        force = peak * np.sin(np.pi * phase) ** 1.5
        middle = down + contact_s / 2
        impacts.append(Waveform(time, force, down, down + contact_s, middle, peak))
        down += contact_s + 2 * float(after) / G
    modulus = 1.0 if purpose != "production" else 0.01
    drop = Drop("", purpose, deck, height, DropFidelity(modulus, 1e-7))
    return DropRun(drop, speeds, tuple(impacts))


def paper_drops(
    bias: float = BIAS, jitter: float = 0.0, peaks: Peaks = "auto", height_std: float = 1e-4
) -> Drops:
    """A sweep; production is biased and its contacts are six times as long."""
    random = np.random.default_rng(0)
    runs = []
    for deck in np.round(np.arange(0.4, 1.001, 0.05), 2).tolist():
        runs.append(paper_drop(deck))
        for off in random.normal(0, jitter, 2).tolist():
            soft = {"purpose": "production", "contact_s": 150e-6}
            runs.append(paper_drop(deck, bias=bias, jitter=off, **soft))
    known = DropTestOfStudy(
        study="paper", title="on paper", pair="a-b", fidelity="quick", record="record.csv",
        height_m=HEIGHT, height_std_m=height_std, peaks=peaks, gravity_m_s2=G, limit_force=True,
        restitution_now=0.7,
    )  # fmt: skip
    return Drops(known, tuple(runs))
