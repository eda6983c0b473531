// What a user chooses: a particle by its number, a contact by the two bodies that it is between, or a
// facet of the workpiece: { particle }, { pair } or { facet }; its numbers, and how it is marked.
import { BufferAttribute, BufferGeometry, Group, Mesh } from "three";
import { CHOSEN, rgb } from "./colours.js";
import { CLASSES, DOMINANT, PATH, QUASI_LINEAR, vector } from "./data.js";
import { Bodies } from "./bodies.js";
import { digits, fixed, whole } from "./dom.js";
import { facetMaterial } from "./shading.js";
import { tinted } from "./workpiece.js";

// Radii, that of a particle in its own and that of a contact in the mean particle radius.
const PARTICLE = 0.6,
  CONTACT = 0.12;

/** What a ray through a point of the picture meets first; within `near` mm of thin contacts if it meets nothing. */
export function underRay(caster, near, frame, { frames, media, contacts, workpiece }) {
  for (const reach of [0, near]) {
    const [first] = [
      { ...media.spheres.hit(caster), choice: (row) => ({ particle: frame.id[row] }) },
      { ...contacts.cylinders.hit(caster, reach), choice: (row) => ({ pair: frames.pair(frame, row) }) },
      { ...workpiece.hit(caster), choice: (row) => ({ facet: row }) },
    ]
      .filter(({ distance }) => distance !== undefined)
      .sort((a, b) => a.distance - b.distance);
    if (first) return first.choice(first.row);
  }
  return null;
}

/** What a text names, such as "12", "12 345" or "12 workpiece"; null if it names nothing. */
export function named(text) {
  const names = text.trim().toLowerCase().split(/[\s,;–-]+/); // prettier-ignore
  if (names.length === 2) return { pair: names };
  return names.length === 1 && /^\d+$/.test(names[0]) ? { particle: Number(names[0]) } : null;
}

/** What was chosen, drawn over everything else. */
export class Chosen {
  constructor(frames, workpiece) {
    Object.assign(this, { frames, workpiece });
    this.body = new Bodies(1, { depthTest: false });
    this.corners = new BufferAttribute(new Float32Array(9), 3);
    const normals = new BufferAttribute(new Float32Array([0, 0, 1, 0, 0, 1, 0, 0, 1]), 3),
      geometry = new BufferGeometry().setAttribute("position", this.corners).setAttribute("normal", normals);
    this.facet = new Mesh(tinted(geometry, CHOSEN), facetMaterial({ depthTest: false }));
    this.group = new Group().add(this.body.mesh, this.facet);
    for (const mesh of this.group.children) Object.assign(mesh, { renderOrder: 1, frustumCulled: false });
  }

  /** Mark what was chosen where it is in a frame; nothing if it is not there. */
  update(frame, { pair, particle, facet }) {
    const { media } = this.frames.head,
      mark = (start, end, radius) => this.body.add(0, start, end, radius, rgb(CHOSEN));
    const row = pair ? this.frames.find(frame, ...pair) : frame.id.indexOf(particle);
    this.body.clear();
    const { from, to } = pair ? this.frames.ends(frame) : { from: frame.centre, to: frame.centre },
      radius = pair ? CONTACT * media.radius : PARTICLE * frame.radius[row];
    if (row >= 0) mark(vector(from, row), vector(to, row), radius);
    this.body.show();
    this.facet.visible = facet !== undefined;
    if (this.facet.visible) this.markFacet(facet);
  }

  markFacet(number) {
    const { corners, group } = this.workpiece;
    this.corners.set(corners.subarray(9 * number, 9 * number + 9));
    this.corners.needsUpdate = true;
    this.facet.position.copy(group.position);
    this.facet.rotation.copy(group.rotation);
  }

  /** Heading and rows of what was chosen at a frame: [[name, value], ...]. */
  numbers(frame, { pair, particle, facet }) {
    if (facet !== undefined) return this.ofFacet(facet);
    return pair ? this.ofContact(pair, frame) : this.ofParticle(particle, frame);
  }

  ofParticle(id, frame) {
    const title = `Particle ${id}`,
      row = frame.id.indexOf(id);
    if (row < 0) return [title, [["not shown at this time", ""]]];
    const forces = frame.normal.filter((_, k) => frame.a[k] === row || frame.b[k] === row),
      places = Array.from(vector(frame.centre, row), (value) => fixed(value, 2));
    return [
      title,
      [
        ["diameter", `${digits(2 * frame.radius[row])} mm`],
        ["x, y, z", `${places.join(", ")} mm`],
        ["speed", `${digits(frame.speed[row])} mm/s`],
        ["displacement", `${digits(this.frames.moved(frame)[row], 3)} mm`],
        ["contacts", whole(forces.length)],
        ["largest normal force", forces.length ? `${digits(Math.max(...forces))} N` : "–"],
      ],
    ];
  }

  ofContact([particle, other], frame) {
    const title = `Particle${/^\d+$/.test(other) ? "s" : ""} ${particle} and ${other}`,
      k = this.frames.find(frame, particle, other);
    if (k < 0) return [title, [["no contact at this time", ""]]];
    const [flags, normal, tangential] = ["flags", "normal", "tangential"].map((name) => frame[name][k]);
    const path = flags & DOMINANT ? "dominant path" : flags & PATH && "path to the bowl",
      chains = [flags & QUASI_LINEAR && "quasi-linear chain", path].filter(Boolean);
    return [
      title,
      [
        ["class", CLASSES[this.frames.classes(frame)[k]]],
        ["normal force", `${digits(normal)} N`],
        ["tangential force", `${digits(tangential)} N`],
        ["tangential / normal", normal > 0 ? digits(tangential / normal, 3) : "–"],
        ["part of", chains.join(", ") || "no chain"],
      ],
    ];
  }

  ofFacet(number) {
    const { depth, azimuth } = this.workpiece.facet(number),
      { columns, own } = this.workpiece;
    return [
      `Facet ${number} of the workpiece`,
      [
        ...own.loads.map(({ name, label, unit }) => [label, `${digits(columns[name][number])} ${unit}`]),
        ["depth below surface", `${digits(depth, 3)} mm`],
        ["azimuth from motion", `${digits((180 / Math.PI) * azimuth, 3)}°`],
      ],
    ];
  }
}
