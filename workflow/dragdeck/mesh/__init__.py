"""Triangle surfaces for the engine: made, read, checked, placed and written.

Everything inside is in metres. A *workpiece* stands upright: +z points along its
axis, away from the floor, and its reference point, the origin, is the middle
of its bounding box in x and y, or the given clamping axis, at its lowest z.
`cylinder` makes meshes that stand so; `upright` and `place` move a user's mesh
there.
"""
