// Profiles of the normal forces: on the workpiece by azimuth and depth, and of all contacts by size.

const SECTORS = 24, // of the circumference, as in loading.json
  LEVELS = 20, // of depth, at most
  PER_DECADE = 8, // bins of the size of forces
  LEFT_OUT = 0.005; // fraction of all contacts that may be weaker than the first bin
const LEAST_DECADE = -15,
  DECADES = 24;

/** The profiles of all frames: `azimuth` (degrees, N), `depth` (mm, N/mm), `map` (N), `size` (log10 of N, contacts). */
export function profilesOf(frames) {
  const { head } = frames,
    [own] = head.workpieces;
  const contacts = frames.times.map((_, number) => onWorkpiece(frames, number, own, head));
  const levels = levelsOf(
      contacts.flatMap(({ depth }) => depth),
      head.frames.step,
    ),
    rows = levels.length - 1;
  const azimuth = [],
    depth = [],
    map = new Float64Array(SECTORS * rows);
  for (const one of contacts) {
    const around = new Float64Array(SECTORS),
      down = new Float64Array(rows);
    one.force.forEach((force, k) => {
      // The end face may lie on a limit: what is no deeper than it, as far as rounded places tell, is above it.
      const below = levels.findIndex((limit) => one.depth[k] <= limit + head.frames.step),
        level = below < 0 ? rows - 1 : Math.max(below - 1, 0);
      down[level] += force / (levels[level + 1] - levels[level]);
      for (const sector of one.sectors[k]) {
        around[sector] += force / 2;
        map[SECTORS * level + sector] += force / 2 / frames.count;
      }
    });
    azimuth.push(around);
    depth.push(down);
  }
  const limits = Array.from({ length: SECTORS + 1 }, (_, k) => -180 + (360 / SECTORS) * k);
  return {
    azimuth: profile(limits, azimuth),
    depth: profile(levels, depth),
    size: sizes(frames),
    map: { sectors: limits, levels, values: map, top: Math.max(...map) || 1 },
  };
}

function profile(limits, values) {
  const mean = new Float64Array(limits.length - 1);
  for (const one of values) one.forEach((value, bin) => (mean[bin] += value / values.length));
  return { limits, values, mean, top: Math.max(...values.map((one) => Math.max(...one))) || 1 };
}

/** The contacts on the workpiece: force (N), depth below the surface (mm), and the sector of each half. */
function onWorkpiece(frames, number, own, head) {
  const [x, y] = own.poses[number],
    heading = own.headings[number],
    width = (2 * Math.PI) / SECTORS;
  const sector = (angle) => ((Math.floor((angle + Math.PI) / width) % SECTORS) + SECTORS) % SECTORS,
    found = { force: [], depth: [], sectors: [] };
  for (const [force, place] of frames.onWorkpiece(number)) {
    const [dx, dy] = [place[0] - x, place[1] - y],
      azimuth = Math.atan2(dy, dx) - heading;
    // Half of a contact that lies on a limit, as far as rounded places tell, belongs to either side.
    const near = Math.min(head.frames.step / Math.hypot(dx, dy), width / 2);
    found.force.push(force);
    found.depth.push(head.surface - place[2]);
    found.sectors.push([sector(azimuth - near), sector(azimuth + near)]);
  }
  return found;
}

/** Limits of levels of depth, mm: round ones from the surface, or above it, and at last the deepest contact. */
function levelsOf(depths, rounding) {
  const least = depths.reduce((one, other) => Math.min(one, other), 0),
    deepest = depths.reduce((one, other) => Math.max(one, other), 0),
    most = Math.max(Math.ceil(100 * (deepest - rounding)) / 100, 0) || 1;
  const step = roundStep((most - least) / (LEVELS - 2)),
    first = Math.floor(least / step),
    last = Math.max(Math.round(most / step), first + 1); // a thin last level is part of the one above it
  return Array.from({ length: last - first + 1 }, (_, k) => (k === last - first ? most : (first + k) * step));
}

/** How many contacts have which normal force; `means`: the mean normal force of each frame, N. */
function sizes(frames) {
  const all = new Float64Array(DECADES * PER_DECADE),
    means = [];
  const counts = frames.times.map((_, number) => {
    const { normal } = frames.at(number),
      bins = new Float64Array(all.length);
    let sum = 0;
    for (const force of normal) {
      const bin = Math.floor((Math.log10(force) - LEAST_DECADE) * PER_DECADE);
      if (bin >= 0 && bin < all.length) bins[bin]++;
      sum += force;
    }
    bins.forEach((count, bin) => (all[bin] += count));
    means.push(normal.length ? sum / normal.length : 0);
    return bins;
  });
  const total = all.reduce((sum, count) => sum + count, 0);
  let first = 0,
    last = all.length;
  for (let weaker = all[0]; first < last - PER_DECADE && weaker <= LEFT_OUT * total; weaker += all[first]) first++;
  while (last > first + PER_DECADE && !all[last - 1]) last--;
  const limits = Array.from({ length: last - first + 1 }, (_, k) => LEAST_DECADE + (first + k) / PER_DECADE);
  const shown = counts.map((bins) => bins.subarray(first, last));
  return { ...profile(limits, shown), means };
}

/** The least of 1, 2, 5, 10, ... times a power of ten that is not below a number. */
function roundStep(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((factor) => factor * power).find((one) => one >= least);
}
