/** Small solids that stand for agents and landmarks: instances of a few shapes in one draw call. */

import {
  BufferAttribute,
  BufferGeometry,
  InstancedBufferGeometry,
  Mesh,
  OctahedronGeometry,
  ShaderMaterial,
} from "three";
import type { Quat, Vec3 } from "../wire";
import { Instances } from "./instances";
import type { Rgb } from "./palette";

/** A dart shows a heading; an octahedron, longer ahead, one that is in doubt; a cube has none. */
export type Shape = "dart" | "octahedron" | "cube" | "pin";
const SHAPES: Shape[] = ["dart", "octahedron", "cube", "pin"];

const VERTEX = /* glsl */ `
attribute float shape;
attribute vec3 centre;
attribute vec4 turn;
attribute vec4 colour;         // and the shape
attribute vec2 size;           // [m], at least [px]
uniform float uPixel;
varying vec3 vNormal;
varying vec3 vColour;
varying vec3 vSeen;

vec3 rotate(vec4 q, vec3 v) {
  return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v);
}

void main() {
  vec4 middle = modelViewMatrix * vec4(centre, 1.0);
  float metre = max(size.x, size.y * uPixel * max(-middle.z, 0.01));
  // A shape that is not this instance's is drawn with no size.
  float shown = abs(shape - colour.w) < 0.5 ? metre : 0.0;
  vec3 at = centre + rotate(turn, position * shown);
  vec4 seen = modelViewMatrix * vec4(at, 1.0);
  vNormal = normalize((modelViewMatrix * vec4(rotate(turn, normal), 0.0)).xyz);
  vSeen = seen.xyz;
  vColour = colour.rgb;
  gl_Position = projectionMatrix * seen;
}`;

const FRAGMENT = /* glsl */ `
uniform float uDark;
varying vec3 vNormal;
varying vec3 vColour;
varying vec3 vSeen;

void main() {
  vec3 n = normalize(vNormal);
  vec3 eye = normalize(-vSeen);
  float lit = 0.62 + 0.38 * max(dot(n, normalize(vec3(0.25, 0.75, 0.6))), 0.0);
  float rim = pow(1.0 - abs(dot(n, eye)), 2.0);
  vec3 colour = vColour * lit + mix(-0.12, 0.22, uDark) * rim;
  gl_FragColor = vec4(colour, 1.0);
}`;

export class Solids {
  readonly mesh: Mesh<InstancedBufferGeometry, ShaderMaterial>;
  private readonly instances: Instances<"centre" | "turn" | "colour" | "size">;

  constructor() {
    const material = new ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      uniforms: { uPixel: { value: 0.001 }, uDark: { value: 1 } },
    });
    this.mesh = new Mesh(shapes(), material);
    this.instances = new Instances(this.mesh, { centre: 3, turn: 4, colour: 4, size: 2 }, 64);
  }

  /** Begins a new drawing of up to `n` solids. */
  begin(n: number): void {
    this.instances.begin(n);
  }

  add(shape: Shape, centre: Vec3, turn: Quat, colour: Rgb, sizeM: number, sizePx: number): void {
    this.instances.add({
      centre,
      turn,
      colour: [...colour, SHAPES.indexOf(shape)],
      size: [sizeM, sizePx],
    });
  }

  finish(pixel: number, isDark: boolean): void {
    this.mesh.material.uniforms["uPixel"]!.value = pixel;
    this.mesh.material.uniforms["uDark"]!.value = isDark ? 1 : 0;
    this.instances.finish();
  }
}

/** All shapes in one geometry, each vertex with the number of its shape. */
function shapes(): InstancedBufferGeometry {
  const parts = [dart(), new OctahedronGeometry(1).scale(1.25, 0.7, 0.7), cube(), pin()];
  const positions: number[] = [];
  const normals: number[] = [];
  const numbers: number[] = [];
  parts.forEach((part, number) => {
    const flat = part.index === null ? part : part.toNonIndexed();
    flat.computeVertexNormals();
    positions.push(...flat.getAttribute("position").array);
    normals.push(...flat.getAttribute("normal").array);
    numbers.push(...new Array<number>(flat.getAttribute("position").count).fill(number));
  });
  const geometry = new InstancedBufferGeometry();
  const attribute = (values: number[], size: number): BufferAttribute =>
    new BufferAttribute(new Float32Array(values), size);
  geometry.setAttribute("position", attribute(positions, 3));
  geometry.setAttribute("normal", attribute(normals, 3));
  geometry.setAttribute("shape", attribute(numbers, 1));
  return geometry;
}

function solid(corners: number[][], faces: number[][]): BufferGeometry {
  const positions = faces.flatMap((face) => face.flatMap((corner) => corners[corner]!));
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(positions), 3));
  return geometry;
}

function dart(): BufferGeometry {
  const corners = [
    [1.25, 0, 0],
    [-0.8, 0.72, 0],
    [-0.8, -0.72, 0],
    [-0.4, 0, 0.42],
    [-0.4, 0, -0.24],
  ];
  const faces = [
    [0, 1, 3],
    [0, 3, 2],
    [0, 4, 1],
    [0, 2, 4],
    [1, 4, 3],
    [2, 3, 4],
  ];
  return solid(corners, faces);
}

function cube(): BufferGeometry {
  const half = 0.62;
  const corners = Array.from({ length: 8 }, (_, i) => [
    i & 4 ? half : -half,
    i & 2 ? half : -half,
    i & 1 ? half : -half,
  ]);
  const faces = [
    [0, 1, 3],
    [0, 3, 2],
    [4, 6, 7],
    [4, 7, 5],
    [0, 4, 5],
    [0, 5, 1],
    [2, 3, 7],
    [2, 7, 6],
    [0, 2, 6],
    [0, 6, 4],
    [1, 5, 7],
    [1, 7, 3],
  ];
  return solid(corners, faces);
}

function pin(): BufferGeometry {
  return new OctahedronGeometry(1).scale(0.62, 0.62, 1);
}
