/** The eye: orbit, top and side views, and following an agent. */

import { PerspectiveCamera, Vector3 } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import type { Vec3 } from "../wire";
import type { Bounds } from "./bounds";

/** What panels cover of the picture [px]. */
export interface Insets {
  left: number;
  right: number;
  top: number;
  bottom: number;
}

export type ViewName = "orbit" | "top" | "side";

/**
 * Directions from the target to the eye: azimuth against x, and height over the horizon [rad]; and
 * how much room is left around the map, which is nowhere wider than its sphere.
 */
const VIEWS: Record<ViewName, { azimuth: number; height: number; margin: number }> = {
  orbit: { azimuth: -1.05, height: 0.5, margin: 1.08 },
  top: { azimuth: -Math.PI / 2, height: Math.PI / 2 - 0.001, margin: 0.92 },
  side: { azimuth: -Math.PI / 2, height: 0.02, margin: 0.92 },
};
const FIELD_OF_VIEW_DEG = 38;
/** How long the eye takes to another view [ms]. */
const FLIGHT_MS = 700;

interface Flight {
  beganMs: number;
  from: Vector3;
  to: Vector3;
  targetFrom: Vector3;
  targetTo: Vector3;
}

/** Part of the distance to the target below which the eye has not moved. */
const ROUNDING = 1e-9;

export class Eye {
  readonly camera = new PerspectiveCamera(FIELD_OF_VIEW_DEG, 1, 0.05, 5000);
  readonly controls: OrbitControls;
  private flight: Flight | null = null;
  /** What is free of panels, in heights of the picture. */
  private free = { width: 1, height: 1 };
  private followed = new Vector3();
  private isFollowing = false;
  /** The eye goes round by itself, slowly [rad/s]. */
  turning = 0;

  constructor(element: HTMLElement, moved: () => void) {
    this.camera.up.set(0, 0, 1);
    this.camera.position.set(20, -20, 16);
    this.controls = new OrbitControls(this.camera, element);
    this.controls.enableDamping = true;
    this.controls.dampingFactor = 0.12;
    this.controls.minDistance = 0.2;
    this.controls.maxPolarAngle = Math.PI - 0.05;
    this.controls.addEventListener("change", moved);
    this.controls.addEventListener("start", () => {
      this.flight = null;
      this.turning = 0;
    });
  }

  /** Size of a pixel at distance one. */
  pixel(height: number): number {
    return (2 * Math.tan((this.camera.fov * Math.PI) / 360)) / Math.max(height, 1);
  }

  /** Takes the size of the picture [px], and how much of it panels cover on either side. */
  resize(width: number, height: number, insets: Insets): void {
    const { left, right, top, bottom } = insets;
    this.camera.aspect = width / Math.max(height, 1);
    this.camera.setViewOffset(width, height, (right - left) / 2, (bottom - top) / 2, width, height);
    this.camera.updateProjectionMatrix();
    this.free = {
      width: Math.max(0.2, (width - left - right) / Math.max(height, 1)),
      height: Math.max(0.2, (height - top - bottom) / Math.max(height, 1)),
    };
  }

  /** Goes to a view of all that there is. */
  show(view: ViewName, bounds: Bounds, nowMs: number, isSudden: boolean): void {
    const { azimuth, height, margin } = VIEWS[view];
    const free = Math.min(this.free.width, this.free.height);
    const fit = Math.tan((this.camera.fov * Math.PI) / 360) * free;
    const distance = (bounds.radius * margin) / fit;
    // The floor lies below the map, and is to be seen too.
    const target = new Vector3(...bounds.centre);
    target.z -= 0.12 * bounds.radius;
    const across = distance * Math.cos(height);
    const eye = new Vector3(
      target.x + across * Math.cos(azimuth),
      target.y + across * Math.sin(azimuth),
      target.z + distance * Math.sin(height),
    );
    this.fly(eye, target, nowMs, isSudden);
  }

  /** Goes near a point, seen from the same side as now. */
  approach(point: Vec3, distance: number, nowMs: number): void {
    const target = new Vector3(...point);
    const away = this.camera.position.clone().sub(this.controls.target);
    away.setLength(Math.min(distance, away.length()));
    this.fly(target.clone().add(away), target, nowMs, false);
  }

  /** Keeps a point where it is in the picture; null to let go. */
  follow(point: Vec3 | null): void {
    if (point === null) {
      this.isFollowing = false;
      return;
    }
    const now = new Vector3(...point);
    if (this.isFollowing) {
      const step = now.clone().sub(this.followed);
      this.camera.position.add(step);
      this.controls.target.add(step);
      if (this.flight !== null) {
        [this.flight.from, this.flight.to, this.flight.targetFrom, this.flight.targetTo].forEach(
          (corner) => corner.add(step),
        );
      }
    }
    this.isFollowing = true;
    this.followed = now;
  }

  /** Moves on; says whether the eye moved by itself. */
  update(nowMs: number, elapsedS: number): boolean {
    let moved = false;
    if (this.flight !== null) {
      const part = Math.min(1, (nowMs - this.flight.beganMs) / FLIGHT_MS);
      const eased = part < 0.5 ? 4 * part ** 3 : 1 - (-2 * part + 2) ** 3 / 2;
      this.camera.position.lerpVectors(this.flight.from, this.flight.to, eased);
      this.controls.target.lerpVectors(this.flight.targetFrom, this.flight.targetTo, eased);
      this.flight = part < 1 ? this.flight : null;
      moved = true;
    }
    if (this.turning !== 0) {
      const away = this.camera.position.clone().sub(this.controls.target);
      away.applyAxisAngle(this.camera.up, this.turning * elapsedS);
      this.camera.position.copy(this.controls.target).add(away);
      moved = true;
    }
    const distance = this.camera.position.distanceTo(this.controls.target);
    this.camera.near = Math.max(0.01, distance / 500);
    this.camera.far = distance * 20 + 100;
    this.camera.updateProjectionMatrix();
    const before = this.camera.position.clone();
    const isTurned = this.controls.update();
    // The controls compute the position anew each time: without this its rounding adds up.
    if (before.distanceTo(this.camera.position) < ROUNDING * distance) {
      this.camera.position.copy(before);
    }
    return isTurned || moved;
  }

  private fly(eye: Vector3, target: Vector3, nowMs: number, isSudden: boolean): void {
    if (isSudden) {
      this.flight = null;
      this.camera.position.copy(eye);
      this.controls.target.copy(target);
      return;
    }
    this.flight = {
      beganMs: nowMs,
      from: this.camera.position.clone(),
      to: eye,
      targetFrom: this.controls.target.clone(),
      targetTo: target,
    };
  }
}
