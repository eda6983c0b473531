"""Rules on an input script: each hit is a fact that LIGGGHTS does not tell."""

import math
from collections.abc import Callable

from dragdeck.script.commands import names_read
from dragdeck.script.facts import ContactModel, Facts, Fix, as_number, as_numbers
from dragdeck.script.findings import Finding, NotApplied, Results, at
from dragdeck.script.flow import Script, is_there

_MOST_BINS = 2e7
_BINS_PER_PARTICLE = 100
_BYTES_PER_BIN = 4
_MOST_MOTIONS = 50
"""Of a mesh, that are compared with a later one."""

_RANDOM_FRACTION = 0.3
"""Solid fraction up to which spheres are inserted at random places without fail."""

_COEFFICIENTS = {
    "tangential": "coefficientFriction",
    "rolling_friction": "coefficientRollingFriction",
    "cohesion": "cohesionEnergyDensity",
}
"""Keywords of a contact model, with the coefficient that each needs."""

_NEEDS = {
    "coefficientRollingFriction": ("rolling_friction", ()),
    "coefficientRollingViscousDamping": ("rolling_friction", ("cdt", "epsd2")),
    "cohesionEnergyDensity": ("cohesion", ("easo/capillary/viscous", "washino/capillary/viscous")),
}
"""Properties with the keyword that they need, and models of it that do not read them."""


def script_findings(script: Script) -> list[Finding | NotApplied]:
    """What the rules DK101 to DK112 say of a script, in the order of its lines."""
    facts = Facts(script)
    results = [result for rule in _RULES for result in rule(facts)]
    order = [*script.texts, ""]
    return sorted(results, key=lambda r: (order.index(r.file), r.line))


def no_friction(facts: Facts) -> Results:
    """DK101: friction without a tangential model."""
    friction = max(facts.values("coefficientFriction"), default=0.0)
    last = [model for model in facts.models if not model.wall][-1:]
    if friction and last and not last[0].command.uncertain and not last[0].has("tangential"):
        message = f"a friction coefficient of {friction:g} has no effect between particles"
        yield at("DK101", last[0].command, message, friction=friction)


def different_wall(facts: Facts) -> Results:
    """DK102: walls without a model that the particles have, and with a coefficient for it."""
    particles = [model for model in facts.models if not model.wall]
    kinds = {as_number(fix.word("atom_type")) for fix in facts.styled("particletemplate/")}
    for keyword, name in _COEFFICIENTS.items() if particles else ():
        model, rows = particles[0].has(keyword), facts.matrix(name)
        if not model or (keyword == "cohesion" and not model.startswith("sjkr")):
            continue
        types = range(1, len(rows) + 1)
        inserted = [row for kind, row in zip(types, rows, strict=True) if kind in kinds] or rows
        lacking: dict[str, tuple[ContactModel, float]] = {}
        for wall in facts.models:
            if wall.wall and wall.wall.end == math.inf and not wall.has(keyword):
                sides = {kind for kind in facts.wall_types(wall.wall) if kind in types}
                value = max((row[kind - 1] for row in inserted for kind in sides), default=0.0)
                lacking |= {wall.wall.id: (wall, value)} if value else {}
        if lacking:
            wall, value = next(iter(lacking.values()))
            message = f"no {keyword} {model} at the walls {', '.join(lacking)}: {name} {value:g}"
            severity = "" if len(rows) > 1 else "note"
            yield at("DK102", wall.command, f"{message} has no effect", severity, value=value)


def unused_property(facts: Facts) -> Results:
    """DK103: a property that no contact model reads."""
    known = [model for model in facts.models if not model.wall]
    if not known or len([*facts.named("pair_style")]) > len(known):
        return
    for name, (keyword, others) in _NEEDS.items():
        models = {model.has(keyword) for model in facts.models}
        value = max(facts.values(name), default=0.0)
        if value and models <= {"", *others}:
            model = f"no contact law has {keyword}"
            if models - {""}:
                model = f"{keyword} {', '.join(sorted(models - {''}))} does not read it"
            command = facts.properties(name)[-1].command
            yield at("DK103", command, f"{name} {value:g} has no effect: {model}", value=value)


def spinning(facts: Facts) -> Results:
    """DK104: epsd or epsd2 without torsionTorque on."""
    for model in () if facts.dialect else facts.models:
        rolling = model.has("rolling_friction")
        if rolling.startswith("epsd") and not model.has("torsionTorque"):
            yield at("DK104", model.command, f"rolling_friction {rolling} without torsionTorque on")
            return


def empty_grid(facts: Facts) -> Results:
    """DK105: a neighbour grid with far more bins than particles."""
    skin = as_number("".join(facts.last("neighbor")[:1]))
    if set("s$") & set("".join(facts.last("boundary")[:3])):
        return
    if facts.box is None or facts.radii is None or skin is None:
        yield NotApplied("DK105", "box, largest radius or skin")
        return
    size = (2 * max(facts.radii) + skin) / 2
    bins = math.prod((high - low) / size for low, high in facts.box.bounds) if size > 0 else 0.0
    words = [fix.word("nparticles") or fix.word("particles_in_region")
             for fix in facts.styled("insert/")]  # fmt: skip
    particles = sum(as_numbers(words) or ())
    if bins > _MOST_BINS and bins > _BINS_PER_PARTICLE * particles:
        count = f" for {particles:,.0f} particles" if particles else ""
        message = f"the box has {bins:.2g} bins{count}: about {bins * _BYTES_PER_BIN / 1e9:.2g} GB,"
        command = next(facts.named("create_box"))
        yield at("DK105", command, f"{message} and slow neighbour lists", bins=bins)


def too_dense(facts: Facts) -> Results:
    """DK106: an insertion beyond the solid fraction of random places."""
    for fix in facts.styled("insert/pack"):
        if fix.word("overlapcheck") == "no":
            continue
        once = fix.word("insert_every") == "once"
        count = fix.word("particles_in_region") or (fix.word("nparticles") if once else "")
        fraction, particles = as_number(fix.word("volumefraction_region")), as_number(count)
        region = facts.regions.get(fix.word("region"))
        if fraction is None and region and region.volume and facts.radii and particles is not None:
            fraction = particles * 4 / 3 * math.pi * min(facts.radii) ** 3 / region.volume
        if fraction is None:
            yield NotApplied("DK106", f"radius or region of the insertion {fix.id}")
        elif fraction > _RANDOM_FRACTION:
            message = f"the insertion {fix.id} asks for a solid fraction of {fraction:.2g}"
            yield at("DK106", fix.command, message, solid_fraction=fraction)


def refused_value(facts: Facts) -> Results:
    """DK107: values that LIGGGHTS 3.8.0 refuses."""
    if facts.dialect:
        yield NotApplied("DK107", f"the script is for {facts.dialect}")
        return
    from dragdeck.physics.contact_mechanics import ENGINE_HARD_PA, ENGINE_SOFTEST_PA

    words = "a coefficient of restitution"
    limits = {"coefficientRestitution": (math.nextafter(0.05, 1), 1.0, words, "")}
    if facts.last("units")[:1] == ["si"]:
        limits["youngsModulus"] = (ENGINE_SOFTEST_PA, ENGINE_HARD_PA, "a Young's modulus", " Pa")
    yes = {command.words[0] for command in facts.script.commands if "yes" in command.words}
    for fix, seed in facts.refused_seeds():
        yield at("DK107", fix.command, f"the seed {seed} is not a prime above 10,000", value=seed)
    for fix in facts.styled("property/global"):
        name, form, values = *[*fix.words[1:3], "", ""][:2], as_numbers(fix.words[3:])
        if values and form == "peratomtypepair":
            types, *values = values
            if len(values) != types * types:
                message = (
                    f"{name} has {len(values)} values for {types:g} types, not {types * types:g}"
                )
                yield at("DK107", fix.command, message, value=len(values))
        low, high, words, unit = limits.get(name, (-math.inf, math.inf, "", ""))
        for value in values or ():
            needed = "soft_particles" if value < low else "hard_particles" if value > high else ""
            if needed and not (unit and needed in yes):
                message = f"{words} of {value:g}{unit}"
                message += f" without {needed} yes" if unit else ""
                yield at("DK107", fix.command, message, value=value)
                break


def absent(facts: Facts) -> Results:
    """DK108: variables that nothing defines, and files that are not there."""
    script = facts.script
    for name, command in script.undefined.items():
        yield at("DK108", command, f"the variable {name} is defined nowhere in the script")
    for command, name in script.absent:
        yield at("DK108", command, f"the script {name} is not there")
    read = {name: command for command in script.commands for name in names_read(command.words)}
    written = {w for c in script.commands if not names_read(c.words) for w in c.words}
    if read and script.changes_files:
        yield NotApplied("DK108", "the script makes or moves files itself")
    for name, command in read.items() if not (script.in_memory or script.changes_files) else ():
        if not set("*$") & set(name) | {name} & written and not is_there(script.folder / name):
            restart = command.words[0] in ("read_restart", "variable")
            yield at("DK108", command, f"the file {name} is not there", "note" if restart else "")


def mesh_without_wall(facts: Facts) -> Results:
    """DK109: a mesh that nothing but a motion names."""
    used, moved = set[str](), set[str]()
    for command in facts.script.commands:
        kind = "".join(command.words[3:4])
        if command.words[0] not in ("unfix", "group", "variable") and "mesh/surface" not in kind:
            names = moved if kind == "move/mesh" else used
            names.update(word.removeprefix("f_").partition("[")[0] for word in command.words[2:])
    for name in facts.meshes.keys() - used:
        what = "is moved, but no wall" if name in moved else "is in no wall"
        message = f"the mesh {name} {what}: particles pass through it"
        yield at("DK109", facts.meshes[name].command, message)


def centre_left_behind(facts: Facts) -> Results:
    """DK110: simultaneous motions of a mesh of which a rotation keeps its centre."""
    resumed = any(facts.named("read_restart"))
    earlier: dict[str, list[Fix]] = {}
    for motion in facts.styled("move/mesh"):
        earlier.setdefault(motion.word("mesh"), []).append(motion)
    pairs = [(first, second) for motions in earlier.values() for place, second in enumerate(motions)
             for first in motions[max(place - _MOST_MOTIONS, 0) : place]]  # fmt: skip
    for first, second in pairs:
        if second.begin >= first.end or first.command.line == second.command.line:
            continue
        kinds = ["".join(fix.words[3:4]) for fix in (first, second)]
        if kinds[0] == "rotate" and kinds[1] in ("linear", "wiggle") and _across(first, second):
            message = f"the rotation {first.id} is defined before the translation {second.id}"
            yield at("DK110", second.command, f"{message}: its centre stays behind")
        elif kinds[1] == "rotate" and resumed and second.vector("origin"):
            message = f"after read_restart, the centre of the rotation {second.id} is that before"
            yield at("DK110", second.command, f"{message} the motion {first.id}")


def _across(turn: Fix, shift: Fix) -> bool:
    """Whether a translation is not along the axis of a rotation."""
    axis, way = turn.vector("axis"), shift.vector("linear") or shift.vector("amplitude")
    if not axis or not way:
        return False
    length = math.hypot(*axis) * math.hypot(*way)
    return abs(sum(a * b for a, b in zip(axis, way, strict=True))) < length * (1 - 1e-6)


def evaluated_again(facts: Facts) -> Results:
    """DK111: contact forces in a dump."""
    columns = {w.partition("[")[0] for dump in facts.named("dump") for w in dump.words[5:]}
    for compute in facts.named("compute"):
        words = compute.words
        local = words[3:4] in (["pair/gran/local"], ["wall/gran/local"])
        forces = local and any(word.startswith("force") for word in words[4:])
        if forces and f"c_{words[1]}" in columns:
            yield at("DK111", compute, f"the forces of {words[3]} are not those of the step")
            return


def unmeasurable(facts: Facts) -> Results:
    """DK112: no dump with ids and radii; contacts that are computed too late."""
    needed = ("id", "radius", "x")
    dumps = [c for c in facts.named("dump") if "".join(c.words[3:4]).startswith("custom")]
    if dumps and facts.models and not any({*needed} <= set(dump.words) for dump in dumps):
        lacking = " and ".join(name for name in needed if name not in dumps[0].words)
        yield at("DK112", dumps[0], f"no dump has {lacking}")
    ran = False
    for command in facts.script.commands:
        ran = (ran or command.words[0] == "run") and command.words[0] != "clear"
        if ran and command.words[0] == "compute" and command.words[3:4] == ["pair/gran/local"]:
            message = "compute pair/gran/local after the first run, which LIGGGHTS refuses"
            yield at("DK112", command, message, "error")
            return


_RULES: tuple[Callable[[Facts], Results], ...] = (
    no_friction, different_wall, unused_property, spinning, empty_grid, too_dense, refused_value,
    absent, mesh_without_wall, centre_left_behind, evaluated_again, unmeasurable,
)  # fmt: skip
