// Materials of the scene: few and short shaders, which compile fast where no graphics card does it.
import { BackSide, DoubleSide, FrontSide, GLSL3, RawShaderMaterial } from "three";

const HEAD = `precision highp float;
uniform mat4 modelViewMatrix, projectionMatrix;
`;
const LIGHT = `float light(vec3 normal) { return 0.58 + 0.42 * max(dot(normal, vec3(0.30, 0.45, 0.84)), 0.0); }
`;

const material = (vertexShader, fragmentShader, options = {}) =>
  new RawShaderMaterial({ glslVersion: GLSL3, vertexShader: HEAD + vertexShader, fragmentShader: "precision highp float;\n" + fragmentShader, ...options });

/** A sphere drawn on a square that faces the camera, with the depth of a sphere: round at any zoom. */
export const sphereMaterial = () => material(`
  in vec2 corner; in vec3 centre, colour; in float radius;
  out vec2 across; out vec3 tint; out vec2 depths;
  void main() {
    vec4 seen = modelViewMatrix * vec4(centre, 1.0);
    seen.xy += radius * corner;
    gl_Position = projectionMatrix * seen;
    across = corner; tint = colour;
    depths = vec2(gl_Position.z, 0.5 * projectionMatrix[2][2] * radius);
  }`, LIGHT + `
  in vec2 across; in vec3 tint; in vec2 depths; out vec4 shown;
  void main() {
    float square = dot(across, across);
    if (square > 1.0) discard;
    float towards = sqrt(1.0 - square);
    gl_FragDepth = 0.5 * depths.x + 0.5 + depths.y * towards;
    shown = vec4(tint * light(vec3(across, towards)), 1.0);
  }`);

/** Cylinders between two points; `halo` draws their back sides larger and in one colour. */
export const cylinderMaterial = (halo) => material(`
  in vec3 position, from, to, colour; in float radius;
  uniform float wider;
  out vec3 tint, facing;
  void main() {
    vec3 axis = normalize(to - from);
    vec3 side = normalize(cross(axis, abs(axis.z) < 0.9 ? vec3(0.0, 0.0, 1.0) : vec3(1.0, 0.0, 0.0)));
    vec3 around = position.x * side + position.y * cross(axis, side);
    vec3 place = mix(from - wider * axis, to + wider * axis, position.z) + (radius + wider) * around;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(place, 1.0);
    facing = mat3(modelViewMatrix) * around; tint = colour;
  }`, LIGHT + `
  in vec3 tint, facing; out vec4 shown;
  void main() { shown = vec4(tint${halo ? "" : " * light(normalize(facing))"}, 1.0); }`,
  { side: halo ? BackSide : FrontSide, uniforms: { wider: { value: 0 } } });

/** Facets with a colour each, lit from the camera's side. */
export const facetMaterial = () => material(`
  in vec3 position, normal, colour;
  out vec3 tint, facing;
  void main() {
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
    facing = mat3(modelViewMatrix) * normal; tint = colour;
  }`, LIGHT + `
  in vec3 tint, facing; out vec4 shown;
  void main() {
    vec3 normal = normalize(facing);
    shown = vec4(tint * (0.3 + 0.7 * light(normal.z < 0.0 ? -normal : normal)), 1.0);
  }`, { side: DoubleSide });

/** Lines of one colour. */
export const lineMaterial = (colour, options) => material(`
  in vec3 position;
  void main() { gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }`, `
  uniform vec3 colour; out vec4 shown;
  void main() { shown = vec4(colour, 1.0); }`, { uniforms: { colour: { value: colour } }, ...options });
