"""What a reduced Young's modulus means for the results of a run, before it is made."""

from dragdeck.cases.case import Case


def not_corrected(case: Case) -> str:
    """What the results of a process with a reduced modulus lack; empty if nothing."""
    chosen = case.study.chosen_fidelity()
    if chosen.youngs_modulus_scale == 1 or chosen.windows is not None:
        return ""
    return (
        f"E x {chosen.youngs_modulus_scale:g} gives more and smaller contact forces than the "
        "physical modulus, by amounts that differ from scene to scene, and the report does not "
        "correct them: fidelity: {tolerance: 0.1} measures them in this scene"
    )


def modulus_note(case: Case) -> tuple[str, str]:
    """What ``check`` and ``explain`` say of a process: a heading and a text."""
    windows = case.study.chosen_fidelity().windows
    measured = "windows at the physical modulus correct the results" if windows else "physical"
    return "Young's modulus", not_corrected(case) or measured
