// What a user chooses: a particle by its number, a contact by the two bodies that it is between, or a
// facet of the workpiece: { particle }, { pair } or { facet }.

/** What a ray through a point of the picture meets first; within `near` mm of thin contacts if it meets nothing. */
export function underRay(caster, near, frame, { frames, media, contacts, workpiece }) {
  const pair = (row) => [String(frame.id[frame.a[row]]), String(frames.other(frame, row))];
  for (const reach of [0, near]) {
    const found = [
      { ...media.hit(caster), choice: (row) => ({ particle: frame.id[row] }) },
      { ...contacts.hit(caster, reach), choice: (row) => ({ pair: pair(row) }) },
      { ...workpiece.hit(caster), choice: (row) => ({ facet: row }) },
    ].filter(({ distance }) => distance < Infinity);
    found.sort((one, other) => one.distance - other.distance);
    if (found.length) return found[0].choice(found[0].row);
  }
  return null;
}

/** The row with the smallest distance, and that; `distance(at)`: of the row there, nothing if the ray passes it. */
export const nearest = (rows, distance) =>
  rows
    .map((row, at) => ({ row, distance: distance(at) ?? Infinity }))
    .reduce((one, other) => (other.distance < one.distance ? other : one), { distance: Infinity });

/** What a text names, such as "12", "12 345" or "12 workpiece"; null if it names nothing. */
export function named(text) {
  const names = text.trim().toLowerCase().split(/[\s,;–-]+/); // prettier-ignore
  if (names.length === 2) return { pair: names };
  return names.length === 1 && /^\d+$/.test(names[0]) ? { particle: Number(names[0]) } : null;
}
