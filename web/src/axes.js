// What the plots have in common: round numbers along an axis, as text, and attributes of SVG elements.
import { minus } from "./numbers.js";

/** The least of 1, 2, 5, 10, ... times a power of ten that is not below a number. */
export function roundStep(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((factor) => factor * power).find((one) => one >= least);
}

/** Round numbers between two, about `most` of them. */
export function ticks(first, last, most) {
  const step = roundStep((last - first) / Math.max(most, 2)),
    from = Math.ceil(first / step);
  return Array.from({ length: Math.max(Math.floor(last / step + 1e-9) - from + 1, 0) }, (_, k) => (from + k) * step);
}

export const plain = (value) => minus(String(Number(value.toPrecision(6))));

export function set(element, attributes) {
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
}
