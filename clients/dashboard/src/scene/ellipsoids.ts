/** Uncertainty as ellipsoids of two standard deviations, in one draw call. */

import {
  CustomBlending,
  FrontSide,
  IcosahedronGeometry,
  InstancedBufferGeometry,
  Mesh,
  OneFactor,
  OneMinusSrcAlphaFactor,
  ShaderMaterial,
} from "three";
import type { Vec3 } from "../wire";
import { choleskyColumns } from "./cholesky";
import { Instances } from "./instances";
import type { Rgb } from "./palette";

/** Two standard deviations. */
const DEVIATIONS = 2;

const VERTEX = /* glsl */ `
attribute vec3 centre;
attribute vec3 columnX;
attribute vec3 columnY;
attribute vec3 columnZ;
attribute vec4 colour;
varying vec3 vNormal;
varying vec3 vSeen;
varying vec4 vColour;

void main() {
  vec3 at = centre + columnX * position.x + columnY * position.y + columnZ * position.z;
  // A surface that is stretched has normals by the cofactors of the stretch.
  vec3 normal_m = cross(columnY, columnZ) * position.x + cross(columnZ, columnX) * position.y
    + cross(columnX, columnY) * position.z;
  vec4 seen = modelViewMatrix * vec4(at, 1.0);
  vNormal = (modelViewMatrix * vec4(normalize(normal_m), 0.0)).xyz;
  vSeen = seen.xyz;
  vColour = colour;
  gl_Position = projectionMatrix * seen;
}`;

const FRAGMENT = /* glsl */ `
uniform float uGlow;
varying vec3 vNormal;
varying vec3 vSeen;
varying vec4 vColour;

void main() {
  float facing = abs(dot(normalize(vNormal), normalize(-vSeen)));
  float alpha = vColour.a * (0.16 + 0.7 * pow(1.0 - facing, 2.2));
  gl_FragColor = vec4(vColour.rgb * alpha, alpha * (1.0 - uGlow));
}`;

export class Ellipsoids {
  readonly mesh: Mesh<InstancedBufferGeometry, ShaderMaterial>;
  private readonly instances: Instances<"centre" | "columnX" | "columnY" | "columnZ" | "colour">;

  constructor() {
    const sphere = new IcosahedronGeometry(1, 10);
    const geometry = new InstancedBufferGeometry();
    geometry.setAttribute("position", sphere.getAttribute("position"));
    const material = new ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      transparent: true,
      depthWrite: false,
      side: FrontSide,
      blending: CustomBlending,
      blendSrc: OneFactor,
      blendDst: OneMinusSrcAlphaFactor,
      uniforms: { uGlow: { value: 0 } },
    });
    this.mesh = new Mesh(geometry, material);
    this.instances = new Instances(
      this.mesh,
      { centre: 3, columnX: 3, columnY: 3, columnZ: 3, colour: 4 },
      64,
    );
  }

  begin(n: number): void {
    this.instances.begin(n);
  }

  /**
   * Adds the ellipsoid of a covariance, given as its upper triangle [m²]. None wider than `limitM`
   * is drawn larger than that: who is lost may be anywhere.
   */
  add(
    centre: Vec3,
    covariance: ArrayLike<number>,
    limitM: number,
    colour: Rgb,
    alpha: number,
  ): void {
    const l = choleskyColumns(covariance);
    const widest = DEVIATIONS * Math.max(...l.map((column) => Math.hypot(...column)));
    const scale = DEVIATIONS * Math.min(1, limitM / Math.max(widest, 1e-9));
    const [columnX, columnY, columnZ] = l.map((column) => column.map((x) => x * scale));
    this.instances.add({
      centre,
      columnX: columnX!,
      columnY: columnY!,
      columnZ: columnZ!,
      colour: [...colour, alpha],
    });
  }

  finish(glow: number): void {
    this.mesh.material.uniforms["uGlow"]!.value = glow;
    this.instances.finish();
  }
}
