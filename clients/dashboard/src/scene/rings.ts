/** Rings and soft discs that face the eye: flashes, marks, firing fields; one draw call. */

import {
  BufferAttribute,
  CustomBlending,
  InstancedBufferGeometry,
  Mesh,
  OneFactor,
  OneMinusSrcAlphaFactor,
  ShaderMaterial,
} from "three";
import type { Vec3 } from "../wire";
import { Instances } from "./instances";
import type { Rgb } from "./palette";

export interface Ring {
  centre: Vec3;
  /** Radius [m], and at least so many pixels. */
  radiusM: number;
  radiusPx: number;
  colour: Rgb;
  alpha: number;
  /** Part of the radius that is filled from the rim inwards; 1 makes a soft disc. */
  thickness: number;
}

/** A ring that grows and fades. */
export interface Flash extends Ring {
  beganMs: number;
  lastsMs: number;
}

/** Most flashes at once: of more, nobody sees any. */
const FLASHES_MAX = 160;

const VERTEX = /* glsl */ `
attribute vec3 centre;
attribute vec4 colour;
attribute vec3 size;           // [m], at least [px], thickness
uniform float uPixel;
varying vec2 vAt;
varying vec4 vColour;
varying float vThickness;
varying float vSoft;

void main() {
  vec4 seen = modelViewMatrix * vec4(centre, 1.0);
  float pixel = uPixel * max(-seen.z, 0.01);
  float radius = max(size.x, size.y * pixel);
  seen.xy += position.xy * radius;
  vAt = position.xy;
  vColour = colour;
  vThickness = max(size.z, 1.6 * pixel / radius);
  vSoft = 1.2 * pixel / radius;
  gl_Position = projectionMatrix * seen;
}`;

const FRAGMENT = /* glsl */ `
uniform float uGlow;
varying vec2 vAt;
varying vec4 vColour;
varying float vThickness;
varying float vSoft;

void main() {
  float r = length(vAt);
  float disc = vThickness >= 0.999 ? pow(max(1.0 - r, 0.0), 1.3) : smoothstep(1.0, 1.0 - vSoft, r)
    * smoothstep(1.0 - vThickness - vSoft, 1.0 - vThickness, r);
  float alpha = vColour.a * disc;
  if (alpha < 0.004) discard;
  gl_FragColor = vec4(vColour.rgb * alpha, alpha * (1.0 - uGlow));
}`;

export class Rings {
  readonly mesh: Mesh<InstancedBufferGeometry, ShaderMaterial>;
  private flashes: Flash[] = [];
  private readonly instances: Instances<"centre" | "colour" | "size">;

  constructor() {
    const geometry = new InstancedBufferGeometry();
    const corners = new Float32Array([-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0]);
    geometry.setAttribute("position", new BufferAttribute(corners, 3));
    geometry.setIndex([0, 1, 2, 0, 2, 3]);
    const material = new ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      transparent: true,
      depthWrite: false,
      depthTest: false,
      blending: CustomBlending,
      blendSrc: OneFactor,
      blendDst: OneMinusSrcAlphaFactor,
      uniforms: { uPixel: { value: 0.001 }, uGlow: { value: 0 } },
    });
    this.mesh = new Mesh(geometry, material);
    this.instances = new Instances(this.mesh, { centre: 3, colour: 4, size: 3 }, 256);
  }

  flash(flash: Flash): void {
    this.flashes.push(flash);
    this.flashes.splice(0, Math.max(0, this.flashes.length - FLASHES_MAX));
  }

  get hasFlashes(): boolean {
    return this.flashes.length > 0;
  }

  /** Begins a new drawing, with the flashes of now. */
  begin(nowMs: number, nSteady: number): void {
    this.flashes = this.flashes.filter((flash) => nowMs - flash.beganMs < flash.lastsMs);
    this.instances.begin(this.flashes.length + nSteady);
    for (const flash of this.flashes) {
      const age = Math.max(0, (nowMs - flash.beganMs) / flash.lastsMs);
      const grown = 0.2 + 0.8 * (1 - (1 - age) ** 3);
      this.add({
        ...flash,
        radiusM: flash.radiusM * grown,
        radiusPx: flash.radiusPx * grown,
        alpha: flash.alpha * (1 - age) ** 1.5,
      });
    }
  }

  add(ring: Ring): void {
    if (this.instances.isFull) {
      return;
    }
    this.instances.add({
      centre: ring.centre,
      colour: [...ring.colour, ring.alpha],
      size: [ring.radiusM, ring.radiusPx, ring.thickness],
    });
  }

  finish(pixel: number, glow: number): void {
    this.mesh.material.uniforms["uPixel"]!.value = pixel;
    this.mesh.material.uniforms["uGlow"]!.value = glow;
    this.instances.finish();
  }
}
