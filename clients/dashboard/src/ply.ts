/** Reads the point cloud of places: PLY, binary, little-endian. */

export interface CloudFile {
  revision: bigint;
  /** 0 where these are all places. */
  sinceRevision: bigint;
  n: number;
  id: Uint32Array;
  /** x, y, z of each place in `map` [m]. */
  position: Float32Array;
  strength: Float32Array;
  visits: Uint32Array;
  /** Stamps of the founding and of the latest visit [s, Unix]. */
  firstS: Float64Array;
  lastS: Float64Array;
  forgotten: Uint32Array;
}

const END = "end_header\n";
const PLACE_BYTES = 40;
const VERTEX =
  "uint id, float x, float y, float z, float strength, uint visits, double first_s, double last_s";
/** A header is a few hundred bytes; more is no cloud. */
const HEADER_BYTES_MAX = 4096;

/** Reads a file. Throws where it is not such a cloud. */
export function readCloud(file: ArrayBuffer): CloudFile {
  const start = new TextDecoder("latin1").decode(file.slice(0, HEADER_BYTES_MAX));
  const end = start.indexOf(END);
  if (!start.startsWith("ply\nformat binary_little_endian 1.0\n") || end < 0) {
    throw new Error("the cloud of places is no binary PLY file");
  }
  const lines = start.slice(0, end).trimEnd().split("\n");
  const number = (begin: string): bigint => {
    const line = lines.find((candidate) => candidate.startsWith(begin));
    return line === undefined ? 0n : BigInt(line.slice(begin.length).trim());
  };
  const properties = vertexProperties(lines);
  if (properties !== VERTEX) {
    throw new Error(`the places of the cloud have other properties than expected: ${properties}`);
  }
  const n = Number(number("element vertex "));
  const nForgotten = Number(number("element forgotten "));
  const view = new DataView(file, end + END.length);
  if (view.byteLength < n * PLACE_BYTES + nForgotten * 4) {
    throw new Error("the cloud of places is shorter than its header says");
  }
  const cloud: CloudFile = {
    revision: number("comment revision "),
    sinceRevision: number("comment since_revision "),
    n,
    id: new Uint32Array(n),
    position: new Float32Array(3 * n),
    strength: new Float32Array(n),
    visits: new Uint32Array(n),
    firstS: new Float64Array(n),
    lastS: new Float64Array(n),
    forgotten: new Uint32Array(nForgotten),
  };
  for (let i = 0, at = 0; i < n; i += 1, at += PLACE_BYTES) {
    cloud.id[i] = view.getUint32(at, true);
    cloud.position[3 * i] = view.getFloat32(at + 4, true);
    cloud.position[3 * i + 1] = view.getFloat32(at + 8, true);
    cloud.position[3 * i + 2] = view.getFloat32(at + 12, true);
    cloud.strength[i] = view.getFloat32(at + 16, true);
    cloud.visits[i] = view.getUint32(at + 20, true);
    cloud.firstS[i] = view.getFloat64(at + 24, true);
    cloud.lastS[i] = view.getFloat64(at + 32, true);
  }
  for (let i = 0; i < nForgotten; i += 1) {
    cloud.forgotten[i] = view.getUint32(n * PLACE_BYTES + 4 * i, true);
  }
  return cloud;
}

function vertexProperties(lines: string[]): string {
  const first = lines.findIndex((line) => line.startsWith("element vertex "));
  const next = lines.findIndex((line, i) => i > first && line.startsWith("element "));
  return lines
    .slice(first + 1, next < 0 ? undefined : next)
    .filter((line) => line.startsWith("property "))
    .map((line) => line.slice("property ".length))
    .join(", ");
}
