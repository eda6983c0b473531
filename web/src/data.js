// The data of the page: columns of numbers, as dragchain/network_page/scene.py writes them, and the frames
// of the run: particles and contacts of one moment, in mm, N and mm/s.

import { Quaternion, Vector3 } from "three";

const BYTES = { u8: 1, u16: 2, u32: 4, f24: 3 };
const ARRAYS = { u8: Uint8Array, u16: Uint16Array, u32: Uint32Array, f24: Float32Array };

/** Read compressed columns in base64; returns typed arrays by the columns' names. */
export async function readColumns(entries, text) {
  const packed = await fetch(`data:;base64,${text.trim()}`);
  const stream = packed.body.pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const columns = {};
  let start = 0;
  for (const { name, kind, length } of entries) {
    const end = start + BYTES[kind] * length;
    columns[name] = decoded(bytes.subarray(start, end), kind, length);
    start = end;
  }
  if (start !== bytes.length) throw new Error("the data of this page are damaged");
  return columns;
}

/** A column: the first bytes of all its numbers, then all second bytes, and so on. */
function decoded(bytes, kind, length) {
  const whole = new Uint32Array(length);
  const shift = kind === "f24" ? 8 : 0; // the fourth byte of a short number is zero
  for (let plane = 0; plane < BYTES[kind]; plane++) {
    const up = 8 * (BYTES[kind] - 1 - plane) + shift;
    for (let k = 0, at = plane * length; k < length; k++, at++) whole[k] |= bytes[at] << up;
  }
  return kind === "f24" ? new Float32Array(whole.buffer) : ARRAYS[kind].from(whole);
}

export const QUASI_LINEAR = 1,
  PATH = 2,
  DOMINANT = 4; // flags of a contact, as scene.py sets them
const FIRST_BODY = 0xfff0; // numbers from here on stand for bodies that are no particle
const PARTS = { particles: ["id", "radius", "speed"], contacts: ["a", "b", "flags", "normal", "tangential"] };

export const CLASSES = ["particle–particle", "particle–workpiece", "particle–bowl"];

/** The vector of this number in an array of (x, y, z) one after another. */
export const vector = (places, number) => places.subarray(3 * number, 3 * number + 3);

export class Frames {
  constructor(head, columns) {
    Object.assign(this, { head, columns, times: head.times, steps: head.steps, count: head.steps.length });
    const { particles, contacts, points } = head.frames;
    this.starts = { particles: starts(particles), contacts: starts(contacts), points: starts(points) };
    this.most = { particles: Math.max(...particles), contacts: Math.max(...contacts) };
    this.partial = this.most.particles < head.media.count;
    this.first = new Map(); // where each particle is when it is first shown
    this.frames = this.steps.map((_, number) => this.read(number));
  }

  /** A frame: arrays of its particles (id, centre, radius, speed) and of its contacts. */
  at(number) {
    return this.frames[number];
  }

  read(number) {
    const frame = { number, centre: this.places("centre", "particles", number) };
    frame.point = this.places("point", "points", number);
    for (const [rows, names] of Object.entries(PARTS))
      for (const name of names) frame[name] = this.columns[name].subarray(...this.range(rows, number));
    const [from, to] = this.range("particles", number);
    frame.turn = this.columns.turn?.subarray(4 * from, 4 * to);
    frame.id.forEach((id, k) => this.first.has(id) || this.first.set(id, vector(frame.centre, k)));
    return frame;
  }

  /** Places, from its centre, and radii of the spheres of a particle, mm: of a clump, those turned as it is. */
  spheres({ id, radius, turn }, k) {
    const clump = (this.head.clumps ?? []).findLast(({ first }) => first <= id[k]);
    if (!clump) return [[[0, 0, 0], radius[k]]];
    const [w, x, y, z] = turn.subarray(4 * k, 4 * k + 4);
    const turned = new Quaternion(x, y, z, w);
    return clump.spheres.map(([a, b, c, r]) => [new Vector3(a, b, c).applyQuaternion(turned).toArray(), r]);
  }

  range(rows, number) {
    return this.starts[rows].slice(number, number + 2);
  }

  /** Places in mm, (x, y, z) one after another, of numbers in 2 bytes that stand axis by axis. */
  places(name, rows, number) {
    const { low, step } = this.head.frames,
      [from, to] = this.range(rows, number),
      column = this.columns[name],
      length = column.length / 3;
    const places = new Float32Array(3 * (to - from));
    for (let axis = 0; axis < 3; axis++)
      for (let k = from; k < to; k++) places[3 * (k - from) + axis] = low[axis] + step * column[axis * length + k];
    return places;
  }

  /** How far each particle has moved since it was first shown, mm. */
  moved(frame) {
    return (frame.moved ??= Float32Array.from(frame.id, (id, k) =>
      distance(this.first.get(id), vector(frame.centre, k)),
    ));
  }

  /** The ends of each contact's line: centre to centre, or centre to contact point; (x, y, z) each. */
  ends(frame) {
    if (frame.ends) return frame.ends;
    const from = new Float32Array(3 * frame.a.length),
      to = new Float32Array(3 * frame.a.length);
    for (let k = 0, outer = 0; k < frame.a.length; k++) {
      from.set(vector(frame.centre, frame.a[k]), 3 * k);
      to.set(frame.b[k] < FIRST_BODY ? vector(frame.centre, frame.b[k]) : vector(frame.point, outer++), 3 * k);
    }
    return (frame.ends = { from, to });
  }

  /** Which particles are on the shown side of a section: { axis, at, side }, or null for all. */
  kept(frame, section) {
    const { axis, at, side } = section ?? { axis: 0, at: Infinity, side: 1 };
    return Uint8Array.from(frame.id, (_, k) => side * (frame.centre[3 * k + axis] - at) <= 0);
  }

  /** The class of each contact: 0 between particles, 1 with the workpiece, 2 with the bowl. */
  classes(frame) {
    const ofBody = (b) => (this.head.bodies[b].startsWith("workpiece") ? 1 : 2);
    return (frame.classes ??= Uint8Array.from(frame.b, (b) => (b < FIRST_BODY ? 0 : ofBody(b))));
  }

  /** The two bodies of a contact: numbers of particles, or workpiece, floor or side. */
  pair({ id, a, b }, contact) {
    return [id[a[contact]], b[contact] < FIRST_BODY ? id[b[contact]] : this.head.bodies[b[contact]]].map(String);
  }

  /** The contact of a particle with another one or a body by name; -1 if they do not touch. */
  find(frame, ...wanted) {
    let strongest = -1;
    for (let k = 0; k < frame.a.length; k++) {
      const pair = this.pair(frame, k),
        same = wanted[0] !== wanted[1] && wanted.every((body) => pair.includes(body));
      if (same && (strongest < 0 || frame.normal[k] > frame.normal[strongest])) strongest = k;
    }
    return strongest;
  }
}

const distance = (from, to) => Math.hypot(...[0, 1, 2].map((axis) => to[axis] - from[axis]));

function starts(counts) {
  const sums = [0];
  for (const count of counts) sums.push(sums.at(-1) + count);
  return sums;
}
