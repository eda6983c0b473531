// What a user chooses: a particle by its number, a contact by the two bodies that it is between, or a
// facet of the workpiece: { particle }, { pair } or { facet }.

/** What a ray through a point of the picture meets first; within `near` mm of thin contacts if it meets nothing. */
export function underRay({ origin, direction }, near, frame, { frames, media, contacts, workpiece }) {
  const pair = (row) => [String(frame.id[frame.a[row]]), String(frames.other(frame, row))];
  const hits = (reach) => [
    { hit: media.hit(origin, direction), choice: (row) => ({ particle: frame.id[row] }) },
    { hit: contacts.hit(origin, direction, reach), choice: (row) => ({ pair: pair(row) }) },
    { hit: workpiece.hit(origin, direction), choice: (row) => ({ facet: row }) },
  ];
  for (const reach of [0, near]) {
    const found = hits(reach).filter(({ hit }) => hit);
    found.sort((one, other) => one.hit.distance - other.hit.distance);
    if (found.length) return found[0].choice(found[0].hit.row);
  }
  return null;
}

/** What a text names, such as "12", "12 345" or "12 workpiece"; null if it names nothing. */
export function named(text) {
  const names = text.trim().toLowerCase().split(/[\s,;–-]+/); // prettier-ignore
  if (names.length === 2) return { pair: names };
  return names.length === 1 && /^\d+$/.test(names[0]) ? { particle: Number(names[0]) } : null;
}
