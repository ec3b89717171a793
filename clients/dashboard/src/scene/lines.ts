/** Many line segments of a width in pixels, in one draw call. */

import {
  BufferAttribute,
  CustomBlending,
  DynamicDrawUsage,
  InstancedBufferAttribute,
  InstancedBufferGeometry,
  Mesh,
  OneFactor,
  OneMinusSrcAlphaFactor,
  ShaderMaterial,
  Vector2,
} from "three";
import type { Vec3 } from "../wire";
import type { Rgb } from "./palette";

const VERTEX = /* glsl */ `
attribute vec3 from;
attribute vec3 to;
attribute vec4 colour;
attribute vec3 style;          // time at either end [s], width [px]
uniform vec2 uSize;            // of the drawing [px]
uniform float uNow;
uniform float uFade;           // [s]; 0 for lines that do not fade
uniform float uRest;           // what is left of a line that has faded
varying vec4 vColour;
varying float vAcross;
varying float vWidth;

void main() {
  vec4 a = modelViewMatrix * vec4(from, 1.0);
  vec4 b = modelViewMatrix * vec4(to, 1.0);
  float near = -0.02;
  if (style.z <= 0.0 || style.x > uNow || (a.z > near && b.z > near)) {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    return;
  }
  // The part behind the eye is cut off: projected, it would come from the wrong side.
  if (a.z > near) { a = mix(b, a, (near - b.z) / (a.z - b.z)); }
  if (b.z > near) { b = mix(a, b, (near - a.z) / (b.z - a.z)); }
  vec4 p = projectionMatrix * a;
  vec4 q = projectionMatrix * b;
  vec2 along = (q.xy / q.w - p.xy / p.w) * uSize;
  float length_px = length(along);
  vec2 direction = length_px > 1e-4 ? along / length_px : vec2(1.0, 0.0);
  vec2 normal = vec2(-direction.y, direction.x);
  // Half a pixel more on either side, for soft edges.
  float half_px = 0.5 * style.z + 0.5;
  vec4 end = position.x < 0.5 ? p : q;
  vec2 offset = normal * position.y * half_px + direction * (position.x - 0.5) * 0.5;
  gl_Position = end + vec4(offset * 2.0 / uSize * end.w, 0.0, 0.0);
  float time = position.x < 0.5 ? style.x : style.y;
  float fresh = clamp(1.0 - (uNow - time) / max(uFade, 1e-6), 0.0, 1.0);
  float left = uFade > 0.0 ? mix(uRest, 1.0, pow(fresh, 1.6)) : 1.0;
  vColour = vec4(colour.rgb, colour.a * left);
  vAcross = position.y * half_px;
  vWidth = 0.5 * style.z;
}`;

const FRAGMENT = /* glsl */ `
uniform float uGlow;
varying vec4 vColour;
varying float vAcross;
varying float vWidth;

void main() {
  float alpha = vColour.a * clamp(vWidth + 0.5 - abs(vAcross), 0.0, 1.0);
  if (alpha < 0.004) discard;
  gl_FragColor = vec4(vColour.rgb * alpha, alpha * (1.0 - uGlow));
}`;

export interface LineOptions {
  fadeS?: number;
  rest?: number;
  depthTest?: boolean;
}

export class Lines {
  readonly mesh: Mesh<InstancedBufferGeometry, ShaderMaterial>;
  private from!: InstancedBufferAttribute;
  private to!: InstancedBufferAttribute;
  private colour!: InstancedBufferAttribute;
  private style!: InstancedBufferAttribute;
  private capacity = 0;

  constructor(options: LineOptions = {}) {
    const geometry = new InstancedBufferGeometry();
    const corners = new Float32Array([0, -1, 0, 1, -1, 0, 1, 1, 0, 0, 1, 0]);
    geometry.setAttribute("position", new BufferAttribute(corners, 3));
    geometry.setIndex([0, 1, 2, 0, 2, 3]);
    const material = new ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      transparent: true,
      depthWrite: false,
      depthTest: options.depthTest ?? true,
      blending: CustomBlending,
      blendSrc: OneFactor,
      blendDst: OneMinusSrcAlphaFactor,
      uniforms: {
        uSize: { value: new Vector2(1, 1) },
        uNow: { value: Infinity },
        uFade: { value: options.fadeS ?? 0 },
        uRest: { value: options.rest ?? 0 },
        uGlow: { value: 0 },
      },
    });
    this.mesh = new Mesh(geometry, material);
    this.mesh.frustumCulled = false;
    this.reserve(64);
  }

  /** Number of segments that are drawn. */
  set count(n: number) {
    this.mesh.geometry.instanceCount = n;
    this.mesh.visible = n > 0;
  }

  /** Makes room; what was there is gone where it was too small. */
  reserve(n: number): void {
    if (n <= this.capacity) {
      return;
    }
    this.capacity = Math.max(n, 2 * this.capacity);
    const make = (size: number): InstancedBufferAttribute => {
      const attribute = new InstancedBufferAttribute(new Float32Array(size * this.capacity), size);
      attribute.setUsage(DynamicDrawUsage);
      return attribute;
    };
    this.from = make(3);
    this.to = make(3);
    this.style = make(3);
    const bytes = new Uint8Array(4 * this.capacity);
    this.colour = new InstancedBufferAttribute(bytes, 4, true);
    this.mesh.geometry.dispose();
    this.mesh.geometry
      .setAttribute("from", this.from)
      .setAttribute("to", this.to)
      .setAttribute("colour", this.colour)
      .setAttribute("style", this.style);
    this.count = 0;
  }

  set(
    i: number,
    from: ArrayLike<number>,
    to: ArrayLike<number>,
    colour: Rgb,
    alpha: number,
    width: number,
    fromS = 0,
    toS = fromS,
  ): void {
    this.from.array.set([from[0]!, from[1]!, from[2]!], 3 * i);
    this.to.array.set([to[0]!, to[1]!, to[2]!], 3 * i);
    this.style.array.set([fromS, toS, width], 3 * i);
    const bytes = this.colour.array;
    bytes[4 * i] = 255 * colour[0];
    bytes[4 * i + 1] = 255 * colour[1];
    bytes[4 * i + 2] = 255 * colour[2];
    bytes[4 * i + 3] = 255 * alpha;
  }

  /** Hides a segment. */
  clear(i: number): void {
    this.style.array[3 * i + 2] = 0;
  }

  /** Sends segments to the graphics card: some, or all. */
  upload(first = 0, n = this.capacity): void {
    for (const attribute of [this.from, this.to, this.style, this.colour]) {
      attribute.addUpdateRange(first * attribute.itemSize, n * attribute.itemSize);
      attribute.needsUpdate = true;
    }
  }

  uniform(name: "uNow" | "uFade" | "uGlow" | "uRest", value: number): void {
    this.mesh.material.uniforms[name]!.value = value;
  }

  resize(width: number, height: number): void {
    (this.mesh.material.uniforms["uSize"]!.value as Vector2).set(width, height);
  }
}

/** Segments that are put one after the other. */
export class LineWriter {
  n = 0;

  constructor(private readonly lines: Lines) {}

  add(from: Vec3, to: Vec3, colour: Rgb, alpha: number, width: number, s = 0, toS = s): void {
    this.lines.set(this.n, from, to, colour, alpha, width, s, toS);
    this.n += 1;
  }

  finish(): void {
    this.lines.count = this.n;
    this.lines.upload(0, this.n);
  }
}
