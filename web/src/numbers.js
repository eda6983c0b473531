// Numbers as text.

/** A number with four significant digits; the data have a little more. */
export function digits(value, count = 4) {
  if (!Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const text = value.toPrecision(count);
  const plain = text.includes("e") && Math.abs(value) >= 1 ? Number(text).toFixed(0) : text;
  return plain.replace("-", "−").replace("e−", "e-");
}

export const seconds = (value) => `${value.toFixed(3).replace("-", "−")} s`;

export const whole = (value) => value.toLocaleString("en-GB").replaceAll(",", "\u202f");
