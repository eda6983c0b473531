"""What the page says about each test: what it shows, and why something differs."""

from __future__ import annotations

LIMIT = (
    "The study's decks set limitForce on: the engine then never lets two bodies pull on each "
    "other. At the end of a damped impact the law would pull for a moment; cutting that off "
    "removes damping, and the particle leaves faster than the deck's restitution says. By how much "
    "is known exactly: speed out over speed in is exp(-x (π - 2 arctan x)) with x = -ln(e)/π, "
    "at any speed, size and stiffness."
)

DAMPER = (
    "The engine caps the spring of friction at friction times normal force, but adds its "
    "tangential damper outside that cap for as long as the spring itself has not reached it. "
    "At first touch the damper of a fast-sliding contact is far stronger than Coulomb's limit, so "
    "the particle gets more tangential impulse than friction times normal impulse. Rigid-body "
    "sliding is exceeded by the more, the lower the restitution; with e = 1 there is no damper "
    "and no excess."
)

ARM = (
    "Friction acts at the middle of the overlap, half an overlap nearer to the centre than the "
    "radius, which takes up to that share from the spin; the tolerance of the comparison with "
    "rigid bodies allows for it."
)

SPRING = (
    "The engine's tangential force is stiffness times the whole displacement of the spring, "
    "with the stiffness of the moment; Mindlin's law, and many codes, add increments instead. "
    "Where a contact sticks, published curves need not coincide with the engine's."
)

CONTRADICTION = (
    "Where the contact sticks, the published points of this test also contradict those of test 4, "
    "which is the same law at nearly the same restitution: at a scaled patch velocity of 4.0 the "
    "scaled spin is -4.84 here and -3.79 there. The engine is close to the latter and to the "
    "finite elements. Why the former lie apart is not known here."
)

OTHER_DAMPING = (
    "The source paper of this project damps the tangential direction with the normal constant; "
    "the engine uses the tangential stiffness in its place, which makes the constant smaller by "
    "the square root of their ratio (0.946 for the ceramic)."
)

WORDS: dict[str, tuple[str, ...]] = {
    "elastic_pair": (
        "Overlap, force, duration and rebound against Hertz. The last row evaluates Hertz's "
        "force at every overlap the engine passed through.",
        "The published force for limestone is met only if each particle moves at 10 m/s, which "
        "confirms constants and speeds.",
    ),
    "elastic_plane": (
        "As test 1, against a plane. Rigid means a plane a million times stiffer than "
        "the particle: "
        "the engine has no rigid material. The last series is the study's particle on "
        "its workpiece.",
    ),
    "restitution": (
        "Without limitForce the deck's restitution comes out at any value.",
        LIMIT,
        "With the limit on no particle can rebound slower than about 0.21: that is what "
        "the smallest "
        "restitution the engine takes, 0.05, turns into.",
    ),
    "oblique_angle": (
        "Tangential restitution, spin and rebound angle of the contact patch over the angle of "
        "incidence, against the law integrated by scipy (all angles) and against rigid-body "
        "sliding (where a rigid particle would slide from begin to end).",
        ARM,
        SPRING,
    ),
    "oblique_study": (
        "The study's ceramic particle on steel, with and without the limit on attraction.",
        DAMPER,
        OTHER_DAMPING,
    ),
    "oblique_tangential": (
        "Scaled as in the paper, in which all elastic materials lie on one curve where they slide. "
        "The published points include finite elements, which a spring law cannot meet where the "
        "contact sticks.",
        SPRING,
        CONTRADICTION,
        "The polyethylene particle flattens by 3 % of its radius; its sliding spin is "
        "lower than that "
        "of a rigid particle by half of this, as it must be.",
    ),
    "spin_plane": (
        "A spinning particle falls on a plane. The law integrated by scipy is met at every spin.",
        DAMPER,
        LIMIT,
        "The published curves have a normal restitution of 0.50 exactly and slide with Coulomb's "
        "impulse (left of 1 in the left panel): the law behind them caps the damper, or has none. "
        "Right of 1 the contact sticks, and spring and damper decide.",
        SPRING,
    ),
    "spin_pair": (
        "The surfaces of two particles with opposite spins roll on each other like two "
        "gears: nothing "
        "tangential may happen at all.",
    ),
    "spin_pair_same": (
        "Two particles with the same spin rub. The line of centres turns a little during the "
        "impact, which the reference leaves out: hence the error of the normal rebound is above "
        "that on a plane. The tangential error is largest for fast slip, which uses up the "
        "spring within a few time steps.",
        DAMPER,
    ),
    "spin_unequal": (
        "The larger particle has five times the radius. A rigid one is also 1,000 times denser, so "
        "that it hardly moves and the test becomes test 6; the second particle of the "
        "paper was not "
        "available here. The last series has one material.",
        "The published points differ for the reasons given in test 6.",
        DAMPER,
    ),
    "time_step": (
        "The rebound of the study's particle over the time step. With the limit on the "
        "error falls in "
        "proportion to the step. Without it, it depends on where in a step the contact begins "
        "and ends, and scatters.",
    ),
    "bounce": (
        "An elastic particle between two walls without gravity. Each impact begins at "
        "another place "
        "within a step, so the energy wanders without a trend.",
    ),
    "momentum": (
        "Oblique, spinning collisions along lines of centres in any direction. Angular momentum "
        "holds because both particles feel the friction at one point.",
    ),
    "column": (
        "Five particles placed on each other and left to ring until they rest. The floor "
        "carries the "
        "weight, and each contact the weight above it.",
    ),
    "incline": (
        "Particles of different friction on one incline of 30 degrees. A particle rolls as long as "
        "tan(angle) is below 7/2 of the friction, and slips beyond; at 1 both formulae agree.",
    ),
}
