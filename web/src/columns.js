// Columns of numbers, as dragchain/network_page/scene.py writes them: the first bytes of all
// numbers of a column, then all second bytes, and so on.

const BYTES = { u8: 1, u16: 2, u32: 4, f24: 3 };
const ARRAYS = { u8: Uint8Array, u16: Uint16Array, u32: Uint32Array, f24: Float32Array };

/** Read compressed columns in base64; returns typed arrays by the columns' names. */
export async function readColumns(entries, text) {
  const bytes = await inflate(fromBase64(text.trim()));
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

function fromBase64(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let k = 0; k < bytes.length; k++) bytes[k] = binary.charCodeAt(k);
  return bytes;
}

async function inflate(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

function decoded(bytes, kind, length) {
  const whole = new Uint32Array(length);
  const shift = kind === "f24" ? 8 : 0; // the fourth byte of a short number is zero
  for (let plane = 0; plane < BYTES[kind]; plane++) {
    const up = 8 * (BYTES[kind] - 1 - plane) + shift;
    for (let k = 0, at = plane * length; k < length; k++, at++) whole[k] |= bytes[at] << up;
  }
  return kind === "f24" ? new Float32Array(whole.buffer) : ARRAYS[kind].from(whole);
}
