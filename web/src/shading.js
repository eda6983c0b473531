// Materials of the scene: few and short shaders, which compile fast where no graphics card does it.
import { DoubleSide, GLSL3, RawShaderMaterial } from "three";

const HEAD = `precision highp float;
uniform mat4 modelViewMatrix, projectionMatrix;
`;
const LIGHT = `float light(vec3 normal) { return 0.58 + 0.42 * max(dot(normal, vec3(0.30, 0.45, 0.84)), 0.0); }
`;

const material = (vertexShader, fragmentShader, options) =>
  new RawShaderMaterial({
    glslVersion: GLSL3,
    vertexShader: HEAD + vertexShader,
    fragmentShader: "precision highp float;\n" + fragmentShader,
    ...options,
  });

// The four corners of a square, by the number of a vertex, and the texels of the body it is of.
const SQUARE = `
  uniform highp sampler2D bodies;
  vec2 corner() { return vec2(gl_VertexID & 1, (gl_VertexID >> 1) & 1) * 2.0 - 1.0; }
  vec4 texel(int number) {
    int at = (gl_VertexID >> 2) * 3 + number, width = textureSize(bodies, 0).x;
    return texelFetch(bodies, ivec2(at % width, at / width), 0);
  }`;

/** Bodies between two points, which may be one: spheres, and cylinders with round ends. Texels:
 *  (start, radius), (end, width of a halo or 0), (colour, 0). In parallel projection the outline of such
 *  a body is that of a stadium, and its depth is exact where it is a sphere. */
export const bodyMaterial = (uniforms, options) =>
  material(
    SQUARE +
      `
  flat out vec3 tint; flat out vec4 shape; flat out vec3 depth; out vec2 place;
  void main() {
    vec4 first = texel(0), second = texel(1);
    vec3 start = (modelViewMatrix * vec4(first.xyz, 1.0)).xyz, end = (modelViewMatrix * vec4(second.xyz, 1.0)).xyz;
    vec2 line = end.xy - start.xy, at = corner();
    float size = length(line), radius = first.w + second.w;
    vec2 along = size > 1e-6 ? line / size : vec2(1.0, 0.0);
    vec2 seen = (at.x < 0.0 ? start.xy : end.xy) + radius * (at.x * along + at.y * vec2(-along.y, along.x));
    gl_Position = projectionMatrix * vec4(seen, start.z, 1.0);
    place = vec2(at.x < 0.0 ? -radius : size + radius, at.y * radius);
    tint = texel(2).rgb; shape = vec4(along, size, radius);
    depth = vec3(start.z, end.z - start.z, second.w > 0.0 ? -2.0 : 1.0);
  }`,
    LIGHT +
      `
  uniform mat4 projectionMatrix;
  flat in vec3 tint; flat in vec4 shape; flat in vec3 depth; in vec2 place; out vec4 shown;
  void main() {
    float size = shape.z, radius = shape.w, nearest = clamp(place.x, 0.0, size);
    vec2 off = vec2(place.x - nearest, place.y) / radius;
    float square = dot(off, off);
    if (square > 1.0) discard;
    float towards = sqrt(1.0 - square), part = size > 1e-6 ? nearest / size : 0.0;
    bool halo = depth.z < 0.0;
    float z = depth.x + part * depth.y + (halo ? -radius : radius * towards);
    gl_FragDepth = 0.5 * (projectionMatrix[2][2] * z + projectionMatrix[3][2]) + 0.5;
    vec3 normal = vec3(off.x * shape.xy + off.y * vec2(-shape.y, shape.x), towards);
    shown = vec4(halo ? tint : tint * light(normal), 1.0);
  }`,
    { side: DoubleSide, uniforms, ...options },
  );

/** Facets with a colour each, lit from the camera's side. */
export const facetMaterial = (options) =>
  material(
    `
  in vec3 position, normal, colour;
  out vec3 tint, facing;
  void main() {
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
    facing = mat3(modelViewMatrix) * normal; tint = colour;
  }`,
    LIGHT +
      `
  in vec3 tint, facing; out vec4 shown;
  void main() {
    vec3 normal = normalize(facing);
    shown = vec4(tint * (0.3 + 0.7 * light(normal.z < 0.0 ? -normal : normal)), 1.0);
  }`,
    { side: DoubleSide, ...options },
  );
