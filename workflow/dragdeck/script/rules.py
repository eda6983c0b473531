"""Rules on an input script: each hit is a fact that LIGGGHTS does not tell."""

import math
import os.path
from collections.abc import Callable, Mapping
from itertools import combinations

from dragdeck.physics.run_limits import ENGINE_HARD_PA, ENGINE_SOFTEST_PA
from dragdeck.script.commands import names_read
from dragdeck.script.facts import Facts, Fix, as_number, as_numbers
from dragdeck.script.findings import Finding, Hits, as_findings, hit, unknown
from dragdeck.script.flow import Script

_MOST_BINS = 2e7
_BINS_PER_PARTICLE = 100
_BYTES_PER_BIN = 4
_MOST_MOTIONS = 50
"""Of a mesh, that are compared with each other."""

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


def script_findings(script: Script) -> list[Finding]:
    """What the rules DK101 to DK112 say of a script, in the order of its lines."""
    facts = Facts(script)
    results = [hit for rule, hits in _RULES.items() for hit in as_findings(rule, hits(facts))]
    order = {file: place for place, file in enumerate([*script.texts, ""])}
    return sorted(results, key=lambda result: (order[result.file], result.line))


def _no_friction(facts: Facts) -> Hits:
    friction = max(facts.values("coefficientFriction"), default=0.0)
    for law in facts.laws[-1:] if friction else ():
        if not law.command.uncertain and not law.has("tangential"):
            yield hit("law", law.command, friction=friction)


def _different_wall(facts: Facts) -> Hits:
    """Walls without a model that the particles have, and with a coefficient for it."""
    kinds = {fix.number("atom_type") for fix in facts.styled("particletemplate/")}
    for keyword, name in _COEFFICIENTS.items():
        model, rows = "".join(law.has(keyword) for law in facts.laws[:1]), facts.matrix(name)
        if not model or (keyword == "cohesion" and not model.startswith("sjkr")):
            continue
        inserted = [row for kind, row in enumerate(rows, 1) if kind in kinds] or rows
        lacking: dict[Fix, float] = {}
        for wall in facts.walls:
            sides = [kind for kind in facts.wall_types(wall) if kind <= len(rows)]
            value = max((row[kind - 1] for row in inserted for kind in sides), default=0.0)
            if value and wall.end == math.inf and not wall.has(keyword):
                lacking[wall] = value
        for wall, value in [*lacking.items()][:1]:
            walls = ", ".join(dict.fromkeys(wall.id for wall in lacking))
            yield hit("wall", wall.command, "" if len(rows) > 1 else "note", keyword=keyword,
                      model=model, walls=walls, property=name, value=value)  # fmt: skip


def _unused_property(facts: Facts) -> Hits:
    known = facts.laws and len(facts.laws) == len([*facts.named("pair_style")])
    for name, (keyword, others) in _NEEDS.items() if known else ():
        models = {law.has(keyword) for law in (*facts.laws, *facts.walls)} - {""}
        value = max(facts.values(name), default=0.0)
        if value and models <= {*others}:
            why = f"no contact law has {keyword}"
            if models:
                why = f"{keyword} {', '.join(sorted(models))} does not read it"
            command = facts.properties(name)[-1].command
            yield hit("property", command, property=name, value=value, why=why)


def _spinning(facts: Facts) -> Hits:
    for law in () if facts.dialect else (*facts.laws, *facts.walls):
        rolling = law.has("rolling_friction")
        if rolling.startswith("epsd") and not law.has("torsionTorque"):
            yield hit("law", law.command, model=rolling)
            return


def _empty_grid(facts: Facts) -> Hits:
    skin = as_number("".join(facts.last("neighbor")[:1]))
    if set("s$") & set("".join(facts.last("boundary")[:3])):
        return
    if facts.box is None or facts.radii is None or skin is None:
        yield unknown("box, largest radius or skin")
        return
    size = (2 * max(facts.radii) + skin) / 2
    bins = math.prod((high - low) / size for low, high in facts.box.bounds) if size > 0 else 0.0
    asked_m3 = sum(_asked_m3(facts, fix) for fix in facts.styled("insert/"))
    particles = asked_m3 / facts.sphere_m3
    if bins > _MOST_BINS and math.isnan(particles):
        yield unknown("the number of particles")
    elif bins > _MOST_BINS and bins > _BINS_PER_PARTICLE * particles:
        gigabytes, command = bins * _BYTES_PER_BIN / 1e9, next(facts.named("create_box"))
        yield hit("box", command, bins=bins, particles=particles, gigabytes=gigabytes)


def _too_dense(facts: Facts) -> Hits:
    """Spheres that are to be inserted at once; what comes in portions has time to settle."""
    for fix in facts.styled("insert/pack"):
        if fix.word("overlapcheck") == "no" or fix.word("insert_every") not in ("", "once"):
            continue
        region, fraction = (
            facts.regions.get(fix.word("region")),
            fix.number("volumefraction_region"),
        )
        if fraction is None:
            fraction = _asked_m3(facts, fix) / ((region and region.volume) or math.nan)
        if math.isnan(fraction):
            yield unknown(f"radius, density or region of the insertion {fix.id}")
        elif fraction > _RANDOM_FRACTION:
            yield hit("region", fix.command, fix=fix.id, solid_fraction=fraction)


def _asked_m3(facts: Facts, fix: Fix) -> float:
    """Volume of the spheres, of the smallest template, that an insertion asks for; NaN: unknown."""
    sphere_m3, region = facts.sphere_m3, facts.regions.get(fix.word("region"))
    units = {"nparticles": sphere_m3, "particles_in_region": sphere_m3,
             "mass": 1 / facts.density_kg_m3, "mass_in_region": 1 / facts.density_kg_m3,
             "volumefraction_region": region.volume if region else math.nan}  # fmt: skip
    for name in (name for name in units if name in fix.words):
        return (fix.number(name) or math.nan) * units[name]
    return math.nan


def _refused_value(facts: Facts) -> Hits:
    if facts.dialect:
        yield unknown(f"the script is for {facts.dialect}")
        return
    yes = {command.words[0] for command in facts.script.commands if "yes" in command.words}
    soft = 0.0 if "soft_particles" in yes else ENGINE_SOFTEST_PA
    hard = math.inf if "hard_particles" in yes else ENGINE_HARD_PA
    limits = {"coefficientRestitution": (math.nextafter(0.05, 1), 1.0)}
    models = {law.word("model") for law in (*facts.laws, *facts.walls)}
    if facts.last("units")[:1] == ["si"] and not all(m.endswith("/stiffness") for m in models):
        limits["youngsModulus"] = soft, hard
    for fix, seed, refused in facts.seeds:
        if refused:
            yield hit("seed", fix.command, value=seed)
    for fix in facts.styled("property/global"):
        name, form, values = *[*fix.words[1:3], "", ""][:2], as_numbers(fix.words[3:])
        if values and form == "peratomtypepair":
            types, *values = values
            if len(values) != types * types:
                yield hit("size", fix.command, property=name, value=len(values), types=types,
                          expected=types * types)  # fmt: skip
        low, high = limits.get(name, (-math.inf, math.inf))
        for value in [value for value in values or () if not low <= value <= high][:1]:
            needed = "soft_particles" if value < low else "hard_particles"
            yield hit(name, fix.command, value=value, needed=needed)


def _absent(facts: Facts) -> Hits:
    """Variables, files, labels and closing quotation marks that are missing."""
    script = facts.script
    for kind in ("variable", "script", "label", "quotes"):
        missing = [(command, name) for command, of_kind, name in script.missing if of_kind == kind]
        for command, _ in missing[:1]:
            yield hit(kind, command, what=", ".join(name for _, name in missing))
    read = {name: command for command in script.commands for name in names_read(command.words)}
    written = {w for c in script.commands if not names_read(c.words) for w in c.words}
    if read and script.changes_files:
        yield unknown("the script makes or moves files itself")
    for name, command in read.items() if not (script.in_memory or script.changes_files) else ():
        known = not set("*$") & set(name) and name not in written
        if known and not os.path.exists(script.file.parent / name):
            restart = command.words[0] in ("read_restart", "variable")
            yield hit("file", command, "note" if restart else "", what=name)


def _mesh_without_wall(facts: Facts) -> Hits:
    used, moved = set[str](), set[str]()
    for command in facts.script.commands:
        kind = "".join(command.words[3:4])
        if command.words[0] not in ("unfix", "group", "variable") and "mesh/surface" not in kind:
            names = moved if kind == "move/mesh" else used
            names.update(word.removeprefix("f_").partition("[")[0] for word in command.words[2:])
    for name in facts.meshes.keys() - used:
        what = "is moved, but no wall" if name in moved else "is in no wall"
        yield hit("mesh", facts.meshes[name].command, mesh=name, what=what)


def _centre_left_behind(facts: Facts) -> Hits:
    """Simultaneous motions of a mesh of which a rotation keeps its centre."""
    resumed = any(facts.named("read_restart"))
    motions = facts.styled("move/mesh")
    of_mesh: dict[str, list[Fix]] = {}
    for motion in motions:
        of_mesh.setdefault(motion.word("mesh"), []).append(motion)
    pairs = [pair for of in of_mesh.values() for pair in combinations(of[:_MOST_MOTIONS], 2)]
    for first, second in pairs:
        if second.begin >= first.end or first.command.line == second.command.line:
            continue
        kinds = ["".join(fix.words[3:4]) for fix in (first, second)]
        if kinds[0] == "rotate" and kinds[1] in ("linear", "wiggle") and _across(first, second):
            yield hit("order", second.command, first=first.id, second=second.id)
        elif kinds[1] == "rotate" and resumed and second.vector("origin"):
            yield hit("restart", second.command, first=first.id, second=second.id)


def _across(turn: Fix, shift: Fix) -> bool:
    """Whether a translation is not along the axis of a rotation."""
    axis, way = turn.vector("axis"), shift.vector("linear") or shift.vector("amplitude")
    if not axis or not way:
        return False
    length = math.hypot(*axis) * math.hypot(*way)
    return abs(sum(a * b for a, b in zip(axis, way, strict=True))) < length * (1 - 1e-6)


def _evaluated_again(facts: Facts) -> Hits:
    columns = {w.partition("[")[0] for dump in facts.named("dump") for w in dump.words[5:]}
    for compute in facts.named("compute"):
        words = compute.words
        local = words[3:4] in (["pair/gran/local"], ["wall/gran/local"])
        forces = local and any(word.startswith("force") for word in words[4:])
        if forces and f"c_{words[1]}" in columns:
            yield hit("compute", compute, style=words[3])
            return


def _unmeasurable(facts: Facts) -> Hits:
    """No dump with ids and radii; contacts that are computed too late."""
    needed = ("id", "radius", "x")
    dumps = [c for c in facts.named("dump") if "".join(c.words[3:4]).startswith("custom")]
    if dumps and facts.laws and not any({*needed} <= set(dump.words) for dump in dumps):
        lacking = " and ".join(name for name in needed if name not in dumps[0].words)
        yield hit("columns", dumps[0], columns=lacking)
    ran = False
    for command in facts.script.commands:
        ran = (ran or command.words[0] == "run") and command.words[0] != "clear"
        if ran and command.words[0] == "compute" and command.words[3:4] == ["pair/gran/local"]:
            yield hit("late", command, "error")
            return


_RULES: Mapping[str, Callable[[Facts], Hits]] = {
    "DK101": _no_friction,
    "DK102": _different_wall,
    "DK103": _unused_property,
    "DK104": _spinning,
    "DK105": _empty_grid,
    "DK106": _too_dense,
    "DK107": _refused_value,
    "DK108": _absent,
    "DK109": _mesh_without_wall,
    "DK110": _centre_left_behind,
    "DK111": _evaluated_again,
    "DK112": _unmeasurable,
}
