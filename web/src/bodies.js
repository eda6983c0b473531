// Many bodies of one shape in one draw call. Each is a square that faces the camera; what differs
// between bodies is in a texture, which the shader reads by the number of the vertex. Drivers that
// compute without a graphics card draw this many times faster than instanced geometry.
import { BufferAttribute, BufferGeometry, DataTexture, FloatType, Mesh, NearestFilter, RGBAFormat } from "three";

const TEXELS = 3; // per body: start and radius, end and width of a halo, colour

export class Bodies {
  /** `most`: room for so many bodies; `material`: of `shading.js`. */
  constructor(most, material) {
    const width = 3 * Math.min(Math.max(most, 1), 512),
      height = Math.ceil((TEXELS * Math.max(most, 1)) / width);
    this.values = new Float32Array(4 * width * height);
    this.texture = new DataTexture(this.values, width, height, RGBAFormat, FloatType);
    Object.assign(this.texture, { minFilter: NearestFilter, magFilter: NearestFilter });
    material.uniforms.bodies = { value: this.texture };
    const geometry = new BufferGeometry(),
      index = new Uint32Array(6 * most);
    for (let k = 0; k < most; k++)
      index.set(
        [0, 1, 3, 0, 3, 2].map((corner) => 4 * k + corner),
        6 * k,
      );
    geometry.setIndex(new BufferAttribute(index, 1));
    this.mesh = new Mesh(geometry, material);
    this.mesh.frustumCulled = false;
    this.count = 0;
  }

  /** Forget all bodies. */
  clear() {
    this.count = 0;
  }

  /** Add a body between two points of this radius; `halo`: width of the rim that is drawn behind it, or 0. */
  add(start, end, radius, halo, tint) {
    const { values } = this,
      at = 4 * TEXELS * this.count++;
    for (let axis = 0; axis < 3; axis++) {
      values[at + axis] = start[axis];
      values[at + 4 + axis] = end[axis];
      values[at + 8 + axis] = tint[axis];
    }
    values[at + 3] = radius;
    values[at + 7] = halo;
  }

  /** Start, end and radius of a body. */
  at(number) {
    const at = 4 * TEXELS * number;
    return [this.values.subarray(at, at + 3), this.values.subarray(at + 4, at + 7), this.values[at + 3]];
  }

  /** Draw the bodies that were added. */
  show() {
    this.mesh.geometry.setDrawRange(0, 6 * this.count);
    this.mesh.visible = this.count > 0;
    const { width } = this.texture.image,
      used = Math.ceil((TEXELS * this.count) / width);
    this.texture.clearUpdateRanges();
    for (let row = 0; row < used; row++) this.texture.addUpdateRange(4 * width * row, 4 * width);
    if (used) this.texture.needsUpdate = true;
  }
}
