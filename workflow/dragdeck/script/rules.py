"""Rules on an input script: each hit is a fact that LIGGGHTS does not tell."""

import math
from collections.abc import Callable, Iterator
from itertools import combinations

from dragdeck.script.commands import EngineCommand, names_read
from dragdeck.script.facts import Facts, Fix, number, numbers
from dragdeck.script.findings import Finding, NotApplied, at
from dragdeck.script.flow import Script

_MOST_BINS = 2e7
_BINS_PER_PARTICLE = 100
_BYTES_PER_BIN = 4
_RANDOM_FRACTION = 0.3
"""Solid fraction up to which spheres are inserted at random places without fail."""


_COEFFICIENTS = {
    "tangential": "coefficientFriction",
    "rolling_friction": "coefficientRollingFriction",
    "cohesion": "cohesionEnergyDensity",
}
"""Keywords of a contact law, with the coefficient that each needs."""

_NEEDS = {
    "coefficientRollingFriction": ("rolling_friction", ()),
    "coefficientRollingViscousDamping": ("rolling_friction", ("cdt", "epsd2")),
    "cohesionEnergyDensity": ("cohesion", ("easo/capillary/viscous", "washino/capillary/viscous")),
}
"""Properties with the keyword that they need, and models of it that do not read them."""

Result = Iterator[Finding | NotApplied]


def script_findings(script: Script) -> list[Finding | NotApplied]:
    """What the rules DK101 to DK112 say of a script, in the order of its lines."""
    facts = Facts(script)
    results = [result for rule in _RULES for result in rule(facts)]
    order = list(script.texts)
    return sorted(
        results,
        key=lambda r: (order.index(r.file), r.line) if isinstance(r, Finding) else (len(order), 0),
    )


def no_friction(facts: Facts) -> Result:
    """DK101: friction without a tangential model."""
    friction = facts.values("coefficientFriction")
    laws = [law for law in facts.laws if law.wall is None]
    if any(friction) and laws and not laws[-1].has("tangential"):
        message = f"a friction coefficient of {max(friction):g} has no effect between particles"
        yield at("DK101", laws[-1].command, message, friction=max(friction))


def different_wall(facts: Facts) -> Result:
    """DK102: walls without a model that the particles have, and with a coefficient for it."""
    particles = [law for law in facts.laws if law.wall is None]
    for keyword, name in _COEFFICIENTS.items() if particles else ():
        model, several = particles[0].has(keyword), len(facts.values(name)) > 1
        lacking = [
            (law, law.wall, value)
            for law in facts.laws
            if law.wall and law.wall.end == math.inf and not law.has(keyword)
            and (value := _at_wall(facts, law.wall, name))
        ]  # fmt: skip
        if lacking and model and (keyword != "cohesion" or model.startswith("sjkr")):
            law, _, value = lacking[0]
            walls = ", ".join(dict.fromkeys(wall.id for _, wall, _ in lacking))
            message = f"no {keyword} {model} at the walls {walls}: {name} {value:g} has no effect"
            yield at("DK102", law.command, message, "" if several else "note", value=value)


def _at_wall(facts: Facts, wall: Fix, name: str) -> float:
    """The largest coefficient of particles with a wall."""
    types = math.isqrt(len(facts.values(name)))
    kinds = {"".join(fix.after("atom_type")) for fix in facts.styled("particletemplate/")}
    inserted = {int(kind) for kind in kinds if kind.isdigit()} or range(1, types + 1)
    pairs = [facts.of_pair(name, a, b) for b in facts.wall_types(wall) for a in inserted]
    return max((value for value in pairs if value is not None), default=0.0)


def unused_property(facts: Facts) -> Result:
    """DK103: a property that no contact law reads."""
    if not facts.laws or len([*facts.named("pair_style")]) > len(
        [w for w in facts.laws if not w.wall]
    ):
        return
    for name, (keyword, others) in _NEEDS.items():
        models = {law.has(keyword) for law in facts.laws}
        if any(facts.values(name)) and models <= {"", *others}:
            command, value = facts.properties(name)[-1].command, max(facts.values(name))
            model = f"no contact law has {keyword}"
            if models - {""}:
                model = f"{keyword} {', '.join(sorted(models - {''}))} does not read it"
            yield at("DK103", command, f"{name} {value:g} has no effect: {model}", value=value)


def spinning(facts: Facts) -> Result:
    """DK104: epsd or epsd2 without torsionTorque on."""
    for law in () if facts.dialect else facts.laws:
        model = law.has("rolling_friction")
        if model.startswith("epsd") and not law.has("torsionTorque"):
            yield at("DK104", law.command, f"rolling_friction {model} without torsionTorque on")
            return


def empty_grid(facts: Facts) -> Result:
    """DK105: a neighbour grid with far more bins than particles."""
    skin = number("".join(facts.last("neighbor")[:1]))
    boundary = facts.last("boundary")[:3]
    if any(set(word) & set("s$") for word in boundary):
        return
    if facts.box is None or facts.radii is None or skin is None:
        yield NotApplied("DK105", "box, largest radius or skin")
        return
    size = (2 * max(facts.radii) + skin) / 2
    bins = math.prod((high - low) / size for low, high in facts.box)
    particles = _particles(facts)
    if bins > _MOST_BINS and (particles is None or bins > _BINS_PER_PARTICLE * particles):
        command = next(facts.named("create_box"))
        count = "" if particles is None else f" for {particles:,.0f} particles"
        yield at(
            "DK105", command,
            f"the box has {bins:.2g} bins{count}: about {bins * _BYTES_PER_BIN / 1e9:.2g} GB, and "
            "slow neighbour lists",
            bins=bins,
        )  # fmt: skip


def _particles(facts: Facts) -> float | None:
    """The number of particles that are inserted; None if one is not known."""
    counts = [
        number("".join(fix.after("nparticles") or fix.after("particles_in_region")))
        for fix in facts.styled("insert/")
    ]
    return None if not counts or None in counts else sum(filter(None, counts))


def too_dense(facts: Facts) -> Result:
    """DK106: an insertion beyond the solid fraction of random places."""
    for fix in facts.styled("insert/pack"):
        volume = facts.volume("".join(fix.after("region")))
        every = fix.after("insert_every")[:1] == ["once"]
        count = fix.after("particles_in_region") or (fix.after("nparticles") if every else ())
        share = number("".join(fix.after("volumefraction_region")))
        if share is None and volume and facts.radii and number("".join(count)) is not None:
            share = float("".join(count)) * 4 / 3 * math.pi * min(facts.radii) ** 3 / volume
        if "no" in fix.after("overlapcheck"):
            continue
        if share is None:
            yield NotApplied("DK106", f"radius or region of the insertion {fix.id}")
        elif share > _RANDOM_FRACTION:
            message = f"the insertion {fix.id} asks for a solid fraction of {share:.2g}"
            yield at("DK106", fix.command, message, solid_fraction=share)


def refused_value(facts: Facts) -> Result:
    """DK107: values that LIGGGHTS 3.8.0 refuses."""
    from dragdeck.physics.contact_mechanics import ENGINE_HARD_PA, ENGINE_SOFTEST_PA

    if facts.dialect:
        yield NotApplied("DK107", f"the script is for {facts.dialect}")
        return
    allowed = {
        c.words[0] for c in facts.named("soft_particles", "hard_particles") if "yes" in c.words
    }
    if facts.last("units")[:1] == ["si"]:
        for fix in facts.properties("youngsModulus"):
            for value in numbers(fix.words[3:]) or []:
                soft = value < ENGINE_SOFTEST_PA and "soft_particles" not in allowed
                hard = value > ENGINE_HARD_PA and "hard_particles" not in allowed
                if soft or hard:
                    needed = "soft_particles" if soft else "hard_particles"
                    message = f"a Young's modulus of {value:g} Pa without {needed} yes"
                    yield at("DK107", fix.command, message, value=value)
                    break
    for fix, seed in facts.refused_seeds():
        yield at("DK107", fix.command, f"the seed {seed} is not a prime above 10,000", value=seed)
    for fix in facts.properties("coefficientRestitution"):
        wrong = [value for value in facts.values(fix.words[1]) if not 0.05 < value <= 1]
        if wrong:
            message = f"a coefficient of restitution of {wrong[0]:g}"
            yield at("DK107", fix.command, message, value=wrong[0])
    yield from _wrong_sizes(facts)


def _wrong_sizes(facts: Facts) -> Result:
    for fix in facts.styled("property/global"):
        words = fix.words
        if words[2:3] == ["peratomtypepair"] and (values := numbers(words[3:])):
            types, count = int(values[0]), len(values) - 1
            if count != types**2:
                message = f"{words[1]} has {count} values for {types} types, not {types**2}"
                yield at("DK107", fix.command, message, value=count)


def absent(facts: Facts) -> Result:
    """DK108: variables that nothing defines, and files that are not there."""
    script = facts.script
    for name, command in script.undefined.items():
        yield at("DK108", command, f"the variable {name} is defined nowhere in the script")
    for command, name in script.absent:
        yield at("DK108", command, f"the script {name} is not there")
    read = {name: command for command in script.commands for name in names_read(command.words)}
    written = {w for c in script.commands if not names_read(c.words) for w in c.words}
    for name, command in read.items() if not script.in_memory else ():
        there = "*" in name or "$" in name or (script.file.parent / name).exists()
        if not there and name not in written:
            restart = command.words[0] in ("read_restart", "variable")
            yield at("DK108", command, f"the file {name} is not there", "note" if restart else "")


def mesh_without_wall(facts: Facts) -> Result:
    """DK109: a mesh that nothing but a motion names."""
    for mesh in facts.styled("mesh/surface"):
        users = [
            command
            for command in facts.script.commands
            if command is not mesh.command
            and command.words[0] not in ("unfix", "group", "variable")
            and (mesh.id in command.words[2:] or _refers(command, mesh.id))
            and command.words[3:4] != ["move/mesh"]
        ]  # fmt: skip
        if not users:
            moved = any(mesh.id in fix.words for fix in facts.styled("move/mesh"))
            what = "is moved, but no wall" if moved else "is in no wall"
            yield at("DK109", mesh.command, f"the mesh {mesh.id} {what}: particles pass through it")


def _refers(command: EngineCommand, name: str) -> bool:
    return any(f"f_{name}[" in word for word in command.words)


def centre_left_behind(facts: Facts) -> Result:
    """DK110: simultaneous motions of a mesh of which a rotation keeps its centre."""
    motions = facts.styled("move/mesh")
    resumed = any(facts.named("read_restart"))
    for first, second in combinations(motions, 2):
        same = first.after("mesh") == second.after("mesh") and second.begin < first.end
        if not same or first.command.line == second.command.line:
            continue
        kinds = [fix.words[3] if len(fix.words) > 3 else "" for fix in (first, second)]
        if kinds[0] == "rotate" and kinds[1] in ("linear", "wiggle") and _across(first, second):
            message = f"the rotation {first.id} is defined before the translation {second.id}"
            yield at("DK110", second.command, f"{message}: its centre stays behind")
        elif kinds[1] == "rotate" and resumed and numbers(second.after("origin", 3)):
            message = f"after read_restart, the centre of the rotation {second.id} is that before"
            yield at("DK110", second.command, f"{message} the motion {first.id}")


def _across(turn: Fix, shift: Fix) -> bool:
    """Whether a translation is not along the axis of a rotation."""
    axis = numbers(turn.after("axis", 3))
    way = numbers(shift.after("linear", 3) or shift.after("amplitude", 3))
    if not axis or not way or len(axis) < 3 or len(way) < 3:
        return False
    length = math.hypot(*axis) * math.hypot(*way)
    return abs(sum(a * b for a, b in zip(axis, way, strict=True))) < length * (1 - 1e-6)


def evaluated_again(facts: Facts) -> Result:
    """DK111: contact forces in a dump."""
    for compute in facts.named("compute"):
        words = compute.words
        local = words[3:4] in (["pair/gran/local"], ["wall/gran/local"])
        if local and any(word.startswith("force") for word in words[4:]):
            name = f"c_{words[1]}["
            if any(word.startswith(name) for c in facts.named("dump") for word in c.words):
                yield at("DK111", compute, f"the forces of {words[3]} are not those of the step")
                return


def unmeasurable(facts: Facts) -> Result:
    """DK112: no dump with ids and radii; contacts that are computed too late."""
    dumps = [c for c in facts.named("dump") if c.words[3:4] and c.words[3].startswith("custom")]
    if dumps and facts.laws and not any({"id", "radius", "x"} <= set(c.words) for c in dumps):
        lacking = [name for name in ("id", "radius", "x") if name not in dumps[0].words]
        yield at("DK112", dumps[0], f"no dump has {' and '.join(lacking)}")
    ran = False
    for command in facts.script.commands:
        ran = (ran or command.words[0] == "run") and command.words[0] != "clear"
        if ran and command.words[0] == "compute" and command.words[3:4] == ["pair/gran/local"]:
            message = "compute pair/gran/local after the first run, which LIGGGHTS refuses"
            yield at("DK112", command, message, "error")
            return


_RULES: tuple[Callable[[Facts], Result], ...] = (
    no_friction, different_wall, unused_property, spinning, empty_grid, too_dense, refused_value,
    absent, mesh_without_wall, centre_left_behind, evaluated_again, unmeasurable,
)  # fmt: skip
