// The data blocks that simulcap put into the page (src/report/track_codec.h): base64, zlib, then
// differences over time and from point to point.

function base64Bytes(text) {
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; ++i) bytes[i] = binary.charCodeAt(i);
  return bytes;
}

export function blockText(number) {
  return document.getElementById(`block-${number}`).textContent;
}

async function inflated(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

const kArrays = { 1: Uint8Array, 2: Uint16Array, 4: Uint32Array };

/** Values of `frames` × points × components from bytes: the inverse of packedTrack(). */
export function unpacked(bytes, { frames, points, components, bytes: width, overTime }) {
  const count = frames * points * components;
  if (bytes.length !== count * width) throw new Error('a block of the report is damaged');
  const values = new kArrays[width](count); // wraps as the differences do
  const frameSize = points * components;
  let place = 0;
  for (let c = 0; c < components; ++c) {
    for (let f = 0; f < frames; ++f) {
      let difference = 0;
      let index = f * frameSize + c;
      for (let p = 0; p < points; ++p, ++place, index += components) {
        let folded = bytes[place];
        for (let b = 1; b < width; ++b) folded += bytes[b * count + place] * 256 ** b;
        const half = Math.floor(folded / 2);
        difference += folded % 2 ? -1 - half : half;
        values[index] = difference + (overTime && f > 0 ? values[index - frameSize] : 0);
      }
    }
  }
  return values;
}

/** Numbers over time: at(frame) gives the frame's values with the grid that they are on. */
export class Track {
  constructor(description) {
    this.points = description.points;
    this.components = description.components;
    this.description = description;
    this.frames = [];
  }

  async load() {
    const { points, components, bytes, over_time: overTime, chunks } = this.description;
    for (const chunk of chunks) {
      const packed = await inflated(base64Bytes(blockText(chunk.block)));
      const values = unpacked(packed, { frames: chunk.frames, points, components, bytes, overTime });
      const size = points * components;
      for (let f = 0; f < chunk.frames; ++f) {
        this.frames.push({
          values: values.subarray(f * size, (f + 1) * size),
          step: chunk.step,
          origin: chunk.origin,
        });
      }
    }
    return this;
  }

  at(frame) {
    return this.frames[Math.min(frame, this.frames.length - 1)];
  }

  /** A frame of positions [m] into a Float32Array. */
  positions(frame, target) {
    const { values, step, origin } = this.at(frame);
    for (let i = 0; i < values.length; i += 3) {
      target[i] = origin[0] + step * values[i];
      target[i + 1] = origin[1] + step * values[i + 1];
      target[i + 2] = origin[2] + step * values[i + 2];
    }
    return target;
  }
}
