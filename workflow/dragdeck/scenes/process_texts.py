"""What a process models and leaves out, in words."""

from dragdeck.decks.deck import LeftOut
from dragdeck.scenes import liquid as liquids
from dragdeck.study.contact_law import coefficient_words
from dragdeck.study.model import Study
from dragdeck.study.workpiece import CylinderShape


def process_models(study: Study) -> dict[str, str]:
    """What a process models, and why."""
    optional, superposed = coefficient_words(study.pairs.values())[0], study.motion.superposed()
    exact, why = study.bowl_facet_size_m is None, "facets, as requested"
    if study.motion.bowl:
        why = "facets, because it moves"
    if study.motion.bowl_rad_s:
        why = "facets, whose surface moves with the rotation"
    if study.bowl.container.rim:
        why = "facets, because its width varies with height"
    bowl = "exact planes and cylinders" if exact else why
    return {
        "particle-particle, particle-workpiece, particle-bowl": "force chains run through all",
        f"bowl: {bowl}": "force chains end there; the force on each particle gives its contacts",
        **{words: "as given in the study" for words in optional},
        **liquids.liquid_models(study),
        "workpiece as facets": "LIGGGHTS moves meshes only",
        **{f"{name} of the workpiece": "as given in the study" for name in superposed},
        f"total force, {study.outputs.workpiece_force_hz:g} Hz": "drag, its spread and its peaks",
        f"workpiece contacts, "
        f"{study.outputs.workpiece_contacts_hz:g} Hz": "few contacts, so a high rate is cheap",
        f"network and particles, {study.outputs.network_hz:g} Hz": "force chains and positions",
    }


def process_leaves_out(study: Study) -> dict[str, LeftOut]:
    """What it leaves out, and why."""
    _, absent = coefficient_words(study.pairs.values())
    workpiece, network = study.outputs.workpiece_contacts_hz, study.outputs.network_hz
    reasons = {
        **liquids.liquid_leaves_out(study),
        "positions, torques, areas of contacts": LeftOut(
            "the particles of the same step have the positions; no report uses the rest",
            "contact_columns",
        ),
        "network during plunge and approach": LeftOut(
            "no statistic counts them", "network_before_drag"
        ),
        "wear, stress and heat of the mesh": LeftOut("no report uses them"),
        **{words: LeftOut("not given in the study") for words in absent},
    }
    if network < workpiece:
        reasons[f"network at {workpiece:g} Hz"] = LeftOut(
            "force chains do not require this rate", "network_rate"
        )
    if study.bowl_facet_size_m is None:
        reasons["facets of the bowl"] = LeftOut(
            "slower; no report uses contacts per facet of the bowl", "bowl_facets"
        )
    shape = study.workpiece.shape
    if isinstance(shape, CylinderShape) and shape.facet_length_m > shape.facet_size_m:
        reasons["short facets along the workpiece"] = LeftOut(
            "a straight side needs none", "workpiece_short_facets"
        )
    return reasons
