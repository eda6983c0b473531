"""How fast LIGGGHTS runs on this machine."""

from dragdeck.documents import Part

SCALE = 1e-3
"""On the modulus of the short run; more where the engine refuses so soft a particle."""


class Speed(Part):
    """Speed of LIGGGHTS measured on this machine.

    Attributes
    ----------
    filling_steps_per_s, drag_steps_per_s : float
    particles, ranks : int
    engine_version : str
    """

    filling_steps_per_s: float
    drag_steps_per_s: float
    particles: int
    ranks: int
    engine_version: str

    def of(self, particles: int) -> "Speed":
        """The speed with another number of particles: a step takes a time a particle."""
        ratio = self.particles / particles
        filling, drag = ratio * self.filling_steps_per_s, ratio * self.drag_steps_per_s
        return Speed(
            filling_steps_per_s=filling,
            drag_steps_per_s=drag,
            particles=particles,
            ranks=self.ranks,
            engine_version=self.engine_version,
        )
