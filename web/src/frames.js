// The frames of the run: particles and contacts of one moment, in mm, N and mm/s.

export const QUASI_LINEAR = 1,
  PATH = 2,
  DOMINANT = 4; // flags of a contact, as scene.py sets them
const FIRST_BODY = 0xfff0; // numbers from here on stand for bodies that are no particle

export const CLASSES = ["particle-particle", "particle-workpiece", "particle-bowl"];

export class Frames {
  constructor(head, columns) {
    Object.assign(this, { head, columns, times: head.times, steps: head.steps, count: head.steps.length });
    const { particles, contacts, points } = head.frames;
    this.starts = { particles: starts(particles), contacts: starts(contacts), points: starts(points) };
    this.most = { particles: Math.max(...particles), contacts: Math.max(...contacts) };
    this.partial = this.most.particles < head.media.count;
    this.first = new Map(); // where each particle is when it is first shown
    this.read = new Array(this.count);
    for (let number = 0; number < this.count; number++) this.remember(number);
  }

  remember(number) {
    const { id, centre } = this.at(number);
    for (let k = 0; k < id.length; k++) {
      if (!this.first.has(id[k])) this.first.set(id[k], centre.slice(3 * k, 3 * k + 3));
    }
  }

  /** A frame: arrays of its particles (id, centre, radius, speed, moved) and of its contacts. */
  at(number) {
    return (this.read[number] ??= { number, ...this.particlesAt(number), ...this.contactsAt(number) });
  }

  particlesAt(number) {
    const [from, to] = range(this.starts.particles, number);
    const part = (name) => this.columns[name].subarray(from, to);
    return { id: part("id"), radius: part("radius"), speed: part("speed"), centre: this.places("centre", from, to) };
  }

  contactsAt(number) {
    const [from, to] = range(this.starts.contacts, number);
    const part = (name) => this.columns[name].subarray(from, to);
    const point = this.places("point", ...range(this.starts.points, number));
    return {
      a: part("a"),
      b: part("b"),
      flags: part("flags"),
      normal: part("normal"),
      tangential: part("tangential"),
      point,
    };
  }

  /** Places in mm, (x, y, z) one after another, of numbers in 2 bytes that stand axis by axis. */
  places(name, from, to) {
    const { low, step } = this.head.frames,
      column = this.columns[name],
      length = column.length / 3;
    const places = new Float32Array(3 * (to - from));
    for (let axis = 0; axis < 3; axis++) {
      for (let k = from; k < to; k++) places[3 * (k - from) + axis] = low[axis] + step * column[axis * length + k];
    }
    return places;
  }

  /** How far each particle has moved since it was first shown, mm. */
  moved(frame) {
    return (frame.moved ??= Float32Array.from(frame.id, (id, k) => {
      const [x, y, z] = this.first.get(id),
        at = frame.centre.subarray(3 * k, 3 * k + 3);
      return Math.hypot(at[0] - x, at[1] - y, at[2] - z);
    }));
  }

  /** The ends of each contact's line: centre to centre, or centre to contact point; (x, y, z) each. */
  ends(frame) {
    if (frame.ends) return frame.ends;
    const from = new Float32Array(3 * frame.a.length),
      to = new Float32Array(3 * frame.a.length);
    for (let k = 0, outer = 0; k < frame.a.length; k++) {
      from.set(frame.centre.subarray(3 * frame.a[k], 3 * frame.a[k] + 3), 3 * k);
      const [places, at] = frame.b[k] < FIRST_BODY ? [frame.centre, frame.b[k]] : [frame.point, outer++];
      to.set(places.subarray(3 * at, 3 * at + 3), 3 * k);
    }
    return (frame.ends = { from, to });
  }

  /** Which particles are on the shown side of a section: { axis, at, side }, or null for all. */
  kept(frame, section) {
    const { axis, at, side } = section ?? { axis: 0, at: Infinity, side: 1 };
    return Uint8Array.from(frame.id, (_, k) => side * (frame.centre[3 * k + axis] - at) <= 0);
  }

  /** Where the centre of a particle or the point of a contact is, mm; null if it is not in the frame.
   *  That of two particles divides the line between their centres as their radii do. */
  place(frame, { particle, pair }) {
    const row = pair ? this.find(frame, ...pair) : frame.id.indexOf(particle);
    if (row < 0) return null;
    if (!pair) return frame.centre.slice(3 * row, 3 * row + 3);
    const { from, to } = this.ends(frame),
      [own, other] = [frame.a, frame.b].map((bodies) => frame.radius[bodies[row]]);
    const part = other ? own / (own + other) : 1;
    return [0, 1, 2].map((axis) => from[3 * row + axis] + part * (to[3 * row + axis] - from[3 * row + axis]));
  }

  /** The class of each contact: 0 between particles, 1 with the workpiece, 2 with the bowl. */
  classes(frame) {
    const ofBody = (b) => (this.head.bodies[b].startsWith("workpiece") ? 1 : 2);
    return (frame.classes ??= Uint8Array.from(frame.b, (b) => (b < FIRST_BODY ? 0 : ofBody(b))));
  }

  /** The contacts on the workpiece: normal force (N) and contact point (mm) of each. */
  onWorkpiece(number) {
    const frame = this.at(number),
      kinds = this.classes(frame),
      found = [];
    for (let k = 0, outer = 0; k < kinds.length; k++) {
      if (kinds[k] === 1) found.push([frame.normal[k], frame.point.subarray(3 * outer, 3 * outer + 3)]);
      if (kinds[k]) outer++;
    }
    return found;
  }

  /** Name of a contact's second body: the particle's number, or workpiece, floor or side. */
  other(frame, contact) {
    const b = frame.b[contact];
    return b < FIRST_BODY ? frame.id[b] : this.head.bodies[b];
  }

  /** The contact of a particle with another one or a body by name; -1 if they do not touch. */
  find(frame, particle, other) {
    const same = (contact) => {
      const pair = [String(frame.id[frame.a[contact]]), String(this.other(frame, contact))];
      return (pair[0] === particle && pair[1] === other) || (pair[1] === particle && pair[0] === other);
    };
    let found = -1;
    for (let k = 0; k < frame.a.length; k++) {
      if (same(k) && (found < 0 || frame.normal[k] > frame.normal[found])) found = k;
    }
    return found;
  }
}

function starts(counts) {
  const sums = [0];
  for (const count of counts) sums.push(sums.at(-1) + count);
  return sums;
}

const range = (sums, number) => [sums[number], sums[number + 1]];
