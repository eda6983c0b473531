// What was chosen, drawn over everything else: a particle, a contact or a facet of the workpiece,
// and the line between the places whose distance is measured.
import { BufferAttribute, BufferGeometry, Group, Mesh } from "three";
import { Bodies } from "./bodies.js";
import { CHOSEN, COLOURS, rgb } from "./colours.js";
import { bodyMaterial, facetMaterial } from "./shading.js";

const PARTICLE = 0.6,
  CONTACT = 0.12,
  END = 0.2,
  LINE = 0.05; // radii, that of a particle in its own and others in the mean particle radius

export class Chosen {
  constructor(frames, workpiece) {
    this.frames = frames;
    this.workpiece = workpiece;
    this.body = new Bodies(4, onTop(bodyMaterial()));
    this.corners = new BufferAttribute(new Float32Array(9), 3);
    const geometry = new BufferGeometry().setAttribute("position", this.corners);
    for (const [name, value] of [
      ["normal", [0, 0, 1]],
      ["colour", rgb(CHOSEN)],
    ]) {
      geometry.setAttribute(name, new BufferAttribute(new Float32Array([value, value, value].flat()), 3));
    }
    this.facet = new Mesh(geometry, onTop(facetMaterial()));
    this.group = new Group().add(this.body.mesh, this.facet);
    for (const mesh of this.group.children) Object.assign(mesh, { renderOrder: 1, frustumCulled: false });
  }

  /** Mark what was chosen where it is in a frame, and the measured places; nothing if they are not there. */
  update(frame, chosen, places) {
    this.body.clear();
    if (chosen?.pair) this.markContact(frame, chosen.pair);
    else if (chosen?.particle !== undefined) this.markParticle(frame, chosen.particle);
    const { radius } = this.frames.head.media;
    for (const place of places) this.body.add(place, place, END * radius, 0, rgb(COLOURS.ink));
    if (places.length === 2) this.body.add(...places, LINE * radius, 0, rgb(COLOURS.ink));
    this.body.show();
    this.facet.visible = chosen?.facet !== undefined;
    if (this.facet.visible) this.markFacet(chosen.facet);
  }

  markContact(frame, pair) {
    const k = this.frames.find(frame, ...pair),
      { from, to } = this.frames.ends(frame);
    if (k < 0) return;
    this.body.add(
      from.subarray(3 * k, 3 * k + 3),
      to.subarray(3 * k, 3 * k + 3),
      CONTACT * this.frames.head.media.radius,
      0,
      rgb(CHOSEN),
    );
  }

  markParticle(frame, id) {
    const row = frame.id.indexOf(id),
      centre = frame.centre.subarray(3 * row, 3 * row + 3);
    if (row >= 0) this.body.add(centre, centre, PARTICLE * frame.radius[row], 0, rgb(CHOSEN));
  }

  markFacet(number) {
    const { corners, group } = this.workpiece;
    this.corners.set(corners.subarray(9 * number, 9 * number + 9));
    this.corners.needsUpdate = true;
    this.facet.position.copy(group.position);
    this.facet.rotation.copy(group.rotation);
  }
}

const onTop = (material) => Object.assign(material, { depthTest: false });
