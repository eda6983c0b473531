// Elements of the page, and numbers as text.

export const byId = (id) => document.getElementById(id);

/** A new element with properties and what it contains. */
export function make(tag, properties, ...parts) {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...parts);
  return element;
}

const RAISED = "⁰¹²³⁴⁵⁶⁷⁸⁹",
  tenTo = (power) => `10${power < 0 ? "⁻" : ""}${[...String(Math.abs(power))].map((digit) => RAISED[digit]).join("")}`;

export const minus = (text) => text.replaceAll("-", "−");

/** A number with four significant digits; the data have a little more. */
export function digits(value, count = 4) {
  if (!Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const text = value.toPrecision(count),
    [front, power] = text.split("e");
  if (power === undefined) return minus(text);
  return Math.abs(value) >= 1 ? minus(Number(text).toFixed(0)) : `${minus(front)} × ${tenTo(Number(power))}`;
}

export const fixed = (value, decimals) => minus(value.toFixed(decimals));

export const seconds = (value) => `${fixed(value, 3)} s`;

export const whole = (value) => value.toLocaleString("en-GB").replaceAll(",", "\u202f");
