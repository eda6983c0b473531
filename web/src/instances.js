// Many bodies of one shape, drawn in one call.
import { DynamicDrawUsage, InstancedBufferAttribute, InstancedBufferGeometry, Mesh } from "three";

export class Instances {
  /** `sizes`: numbers per body of each attribute; `most`: room for so many bodies. */
  constructor(shape, sizes, most, material) {
    const geometry = new InstancedBufferGeometry();
    geometry.index = shape.index;
    Object.assign(geometry.attributes, shape.attributes);
    this.arrays = {};
    for (const [name, size] of Object.entries(sizes)) {
      const attribute = new InstancedBufferAttribute(new Float32Array(size * most), size);
      attribute.setUsage(DynamicDrawUsage);
      geometry.setAttribute(name, attribute);
      this.arrays[name] = attribute.array;
    }
    this.mesh = new Mesh(geometry, material);
    this.mesh.frustumCulled = false;
  }

  /** Show the first `count` bodies as their arrays now say. */
  show(count) {
    const { geometry } = this.mesh;
    geometry.instanceCount = count;
    this.mesh.visible = count > 0;
    for (const name of Object.keys(this.arrays)) {
      const attribute = geometry.attributes[name];
      attribute.clearUpdateRanges();
      attribute.addUpdateRange(0, count * attribute.itemSize);
      attribute.needsUpdate = true;
    }
  }
}
