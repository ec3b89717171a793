/** The places as one point cloud, by strength or by age, in one draw call. */

import {
  BufferAttribute,
  BufferGeometry,
  CustomBlending,
  DynamicDrawUsage,
  OneFactor,
  OneMinusSrcAlphaFactor,
  Points,
  ShaderMaterial,
  Vector3,
} from "three";
import type { Cloud } from "../memory/cloud";
import { rgb, type Palette } from "./palette";

/** What the colour of a place says. */
export type PlaceColour = "strength" | "age";
/** After this long without a visit a place is half as fresh [s]. */
const AGE_HALF_S = 60;

const VERTEX = /* glsl */ `
attribute vec4 facts;          // strength, visits, first and last second
uniform float uNow;
uniform float uUntil;          // places founded later are not there yet [s]
uniform float uByAge;
uniform float uStrengthMax;
uniform float uAgeHalf;
uniform float uRadius;         // of a place [m]
uniform float uPixel;          // size of a pixel at distance one
uniform float uMin;            // least radius [px]
uniform vec2 uDepth;           // nearest and farthest distance of the cloud
uniform vec3 uRamp[4];
varying vec4 vColour;

vec3 ramp(float x) {
  float at = clamp(x, 0.0, 1.0) * 3.0;
  vec3 low = mix(uRamp[0], uRamp[1], clamp(at, 0.0, 1.0));
  vec3 middle = mix(low, uRamp[2], clamp(at - 1.0, 0.0, 1.0));
  return mix(middle, uRamp[3], clamp(at - 2.0, 0.0, 1.0));
}

void main() {
  vec4 seen = modelViewMatrix * vec4(position, 1.0);
  if (facts.x < 0.0 || facts.z > uUntil) {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    gl_PointSize = 0.0;
    return;
  }
  gl_Position = projectionMatrix * seen;
  float strength = log(1.0 + max(facts.x - 0.5, 0.0)) / log(1.0 + max(uStrengthMax - 0.5, 1.0));
  float fresh = exp2(-max(uNow - min(facts.w, uNow), 0.0) / uAgeHalf);
  float value = mix(strength, fresh, uByAge);
  float fog = smoothstep(uDepth.x, uDepth.y, -seen.z);
  float radius = uRadius * (0.75 + 0.5 * value);
  gl_PointSize = 2.0 * clamp(radius / (-seen.z * uPixel), uMin, 24.0 * uMin);
  vColour = vec4(ramp(value), mix(0.95, 0.3, fog) * mix(0.62, 1.0, value));
}`;

const FRAGMENT = /* glsl */ `
uniform float uGlow;
varying vec4 vColour;

void main() {
  float r = 2.0 * length(gl_PointCoord - 0.5);
  float alpha = vColour.a * smoothstep(1.0, 0.55, r);
  if (alpha < 0.01) discard;
  vec3 colour = vColour.rgb * (1.0 + 0.25 * (0.5 - r));
  gl_FragColor = vec4(colour * alpha, alpha * (1.0 - 0.5 * uGlow));
}`;

export class Places {
  readonly points: Points<BufferGeometry, ShaderMaterial>;
  private readonly centre = new Vector3();
  private palette: Palette | null = null;
  private colouring: PlaceColour = "strength";

  constructor(private readonly cloud: Cloud) {
    const material = new ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      transparent: true,
      depthWrite: false,
      blending: CustomBlending,
      blendSrc: OneFactor,
      blendDst: OneMinusSrcAlphaFactor,
      uniforms: {
        uNow: { value: 0 },
        uUntil: { value: 0 },
        uByAge: { value: 0 },
        uStrengthMax: { value: 1 },
        uAgeHalf: { value: AGE_HALF_S },
        uRadius: { value: 0.07 },
        uPixel: { value: 0.001 },
        uMin: { value: 1.1 },
        uDepth: { value: [0, 1] },
        uGlow: { value: 0 },
        uRamp: { value: [0, 1, 2, 3].map(() => new Vector3()) },
      },
    });
    this.points = new Points(new BufferGeometry(), material);
    this.points.frustumCulled = false;
    this.attach();
  }

  set colour(colour: PlaceColour) {
    this.colouring = colour;
    this.points.material.uniforms["uByAge"]!.value = colour === "age" ? 1 : 0;
    this.repaint();
  }

  paint(palette: Palette): void {
    this.palette = palette;
    this.points.material.uniforms["uGlow"]!.value = palette.glow;
    this.repaint();
  }

  /** Takes in what changed in the cloud, and shows it as of a time. */
  update(
    nowS: number,
    untilS: number,
    pixel: number,
    ratio: number,
    depth: [number, number],
  ): void {
    const uniforms = this.points.material.uniforms;
    uniforms["uNow"]!.value = nowS;
    uniforms["uUntil"]!.value = untilS;
    uniforms["uPixel"]!.value = pixel;
    uniforms["uMin"]!.value = 1.1 * ratio;
    uniforms["uDepth"]!.value = depth;
    uniforms["uStrengthMax"]!.value = this.cloud.strengthMax;
    const dirty = this.cloud.dirty;
    if (dirty === null) {
      return;
    }
    this.cloud.dirty = null;
    if (dirty.isReplaced) {
      this.attach();
    } else {
      for (const name of ["position", "facts"]) {
        const attribute = this.points.geometry.getAttribute(name) as BufferAttribute;
        const size = attribute.itemSize;
        attribute.addUpdateRange(dirty.from * size, (dirty.to - dirty.from) * size);
        attribute.needsUpdate = true;
      }
    }
    this.points.geometry.setDrawRange(0, this.cloud.n);
    this.points.visible = this.cloud.n > 0;
  }

  private attach(): void {
    const geometry = this.points.geometry;
    geometry.dispose();
    const position = new BufferAttribute(this.cloud.position, 3).setUsage(DynamicDrawUsage);
    const facts = new BufferAttribute(this.cloud.facts, 4).setUsage(DynamicDrawUsage);
    geometry.setAttribute("position", position);
    geometry.setAttribute("facts", facts);
    geometry.setDrawRange(0, this.cloud.n);
    this.points.visible = this.cloud.n > 0;
  }

  private repaint(): void {
    if (this.palette === null) {
      return;
    }
    const stops = this.palette[this.colouring];
    const ramp = this.points.material.uniforms["uRamp"]!.value as Vector3[];
    ramp.forEach((stop, i) => stop.copy(this.centre.set(...rgb(stops[i]!))));
  }
}
