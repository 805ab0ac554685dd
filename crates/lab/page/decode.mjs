// From bytes to numbers: what detection.rs and cloud.rs write.
const text = new TextDecoder();

/** One detection: its header, `time`, a Float32Array for each column, modes of the three legs, and its samples. */
export function detection(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(text.decode(new Uint8Array(buffer, 4, length)));
  let at = 4 + length;
  const take = (Type, count) => {
    const array = new Type(buffer, at, count);
    at += count * Type.BYTES_PER_ELEMENT;
    return array;
  };
  const { rows, samples } = header;
  const found = { ...header, time: take(Float64Array, rows), sample: { time: take(Float64Array, samples) } };
  for (const name of header.columns) found[name] = take(Float32Array, rows);
  for (const name of header.sample_columns) found.sample[name] = take(Float32Array, samples);
  found.leg = [0, 1, 2].map(() => take(Uint8Array, rows));
  return found;
}

/** Takes pieces of a stream and calls `frame(kind, DataView)` for each frame that is whole. */
export function frames(frame) {
  let rest = new Uint8Array(0);
  return piece => {
    let bytes = piece;
    if (rest.length) {
      bytes = new Uint8Array(rest.length + piece.length);
      bytes.set(rest);
      bytes.set(piece, rest.length);
    }
    let at = 0;
    while (bytes.length - at >= 8) {
      const view = new DataView(bytes.buffer, bytes.byteOffset + at);
      const length = view.getUint32(0, true);
      if (bytes.length - at < 8 + length) break;
      frame(view.getUint32(4, true), new DataView(bytes.buffer, bytes.byteOffset + at + 8, length));
      at += 8 + length;
    }
    rest = bytes.slice(at);
  };
}

/** The JSON of a frame. */
export const words = view => JSON.parse(text.decode(view));

/** The points of a frame: calls `point(trial, angle, error, verdict, wrong)`. */
export function points(view, point) {
  for (let at = 0; at + 16 <= view.byteLength; at += 16) {
    const flags = view.getUint32(at + 12, true);
    point(view.getUint32(at, true), view.getFloat32(at + 4, true), view.getFloat32(at + 8, true), flags & 3, (flags & 4) !== 0);
  }
}
