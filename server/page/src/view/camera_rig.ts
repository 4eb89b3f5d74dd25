// The camera: free flight, the eyes of an avatar, or behind it.
import { Euler, Vector3, type Box3 } from "three";
import type { App } from "../app";
import type { Input } from "../walk/input";

type ViewMode = "free" | "first" | "third";

const MAX_PITCH = 1.54; // radians: short of straight up
const FLIGHT_SPEED = 4; // metres per second
const RUN_FACTOR = 3;
const BEHIND = 3.2; // metres from the avatar in third person
const MARGIN = 0.15; // metres between the camera and a wall behind it
const TRAVEL_SECONDS = 0.6;

interface Travel {
  from: { position: Vector3; yaw: number; pitch: number };
  to: { position: Vector3; yaw: number; pitch: number };
  done: number; // fraction
}

export class CameraRig {
  position = new Vector3(0, 1.7, 0);
  yaw = 0; // radians about +Y; 0 looks along +X, as Spawn.facing
  pitch = 0; // radians, up is positive
  mode: ViewMode = "free";
  onModeChanged: () => void = () => {};
  #app: App;
  #input: Input;
  #behind = BEHIND;
  #travel: Travel | null = null;

  constructor(app: App, input: Input) {
    this.#app = app;
    this.#input = input;
    app.view.updaters.push((seconds) => this.#update(seconds));
  }

  /** Unit vector of the view. */
  get forward(): Vector3 {
    const level = Math.cos(this.pitch);
    return new Vector3(Math.cos(this.yaw) * level, Math.sin(this.pitch), -Math.sin(this.yaw) * level);
  }

  get right(): Vector3 {
    return new Vector3(Math.sin(this.yaw), 0, Math.cos(this.yaw));
  }

  setMode(mode: ViewMode): void {
    if (this.mode === mode) return;
    this.mode = mode;
    this.#travel = null;
    this.onModeChanged();
    this.#app.view.invalidate();
  }

  look(yaw: number, pitch: number): void {
    this.#travel = null;
    this.yaw = wrapAngle(this.yaw + yaw);
    this.pitch = clampPitch(this.pitch + pitch);
    this.#app.view.invalidate();
  }

  lookAlong(direction: Vector3): void {
    ({ yaw: this.yaw, pitch: this.pitch } = computeAngles(direction));
    this.#app.view.invalidate();
  }

  zoom(steps: number): void {
    if (this.mode === "third") this.#behind = Math.min(40, Math.max(1, this.#behind * 1.15 ** steps));
    else if (this.mode === "free") this.position.addScaledVector(this.forward, -0.6 * steps);
    this.#app.view.invalidate();
  }

  /** Flies to a place and looks at a target. */
  flyTo(position: Vector3, target: Vector3): void {
    const to = { position: position.clone(), ...computeAngles(target.clone().sub(position)) };
    to.yaw = this.yaw + wrapAngle(to.yaw - this.yaw);
    this.setMode("free");
    this.#app.setFocus("");
    this.#travel = { from: { position: this.position.clone(), yaw: this.yaw, pitch: this.pitch }, to, done: 0 };
    this.#app.view.invalidate();
  }

  /** Flies to where a box fills the picture, from the present side if possible. */
  showBox(box: Box3): void {
    const center = box.getCenter(new Vector3());
    const distance = Math.max(1.2, 1.1 * box.min.distanceTo(box.max));
    const away = this.position.clone().sub(center);
    if (away.lengthSq() < 1e-6) away.set(1, 0.4, 1);
    away.normalize();
    away.y = Math.max(away.y, 0.25);
    const hit = this.#app.model?.raycast(center.clone().addScaledVector(away, 0.5 * box.min.distanceTo(box.max) + 0.01), away, distance);
    const reach = Math.max(0.8, Math.min(distance, hit ? hit.distance - MARGIN : distance));
    this.flyTo(center.clone().addScaledVector(away.normalize(), reach), center);
  }

  #update(seconds: number): boolean {
    const { camera } = this.#app.view;
    const moves = this.mode === "free" ? this.#moveFreely(seconds) : this.#follow();
    camera.position.copy(this.position);
    camera.setRotationFromEuler(new Euler(this.pitch, this.yaw - Math.PI / 2, 0, "YXZ"));
    return moves;
  }

  #moveFreely(seconds: number): boolean {
    const travel = this.#travel;
    if (travel) {
      travel.done = Math.min(1, travel.done + seconds / TRAVEL_SECONDS);
      const part = travel.done * travel.done * (3 - 2 * travel.done);
      this.position.lerpVectors(travel.from.position, travel.to.position, part);
      this.yaw = travel.from.yaw + (travel.to.yaw - travel.from.yaw) * part;
      this.pitch = travel.from.pitch + (travel.to.pitch - travel.from.pitch) * part;
      if (travel.done === 1) this.#travel = null;
      return true;
    }
    const { forward, right, up, running } = this.#input.motion;
    if (forward === 0 && right === 0 && up === 0) return false;
    const way = this.forward.multiplyScalar(forward).addScaledVector(this.right, right);
    way.y += up;
    this.position.addScaledVector(way.clampLength(0, 1), FLIGHT_SPEED * (running ? RUN_FACTOR : 1) * seconds);
    return true;
  }

  #follow(): boolean {
    const avatar = this.#app.state.findAvatar(this.#app.focus);
    if (!avatar) return false;
    const eyes = avatar.feet.clone();
    eyes.y += avatar.eyeHeight;
    if (this.mode === "first") {
      this.position.copy(eyes);
      // The eyes of another avatar look where it looks.
      if (avatar.state.name !== this.#app.own) ({ yaw: this.yaw, pitch: this.pitch } = computeAngles(avatar.gaze));
    } else {
      const back = this.forward.negate();
      const hit = this.#app.model?.raycast(eyes, back, this.#behind + MARGIN);
      this.position.copy(eyes).addScaledVector(back, hit ? Math.max(0.3, hit.distance - MARGIN) : this.#behind);
    }
    return false; // the states ask for frames
  }
}

function computeAngles(direction: Vector3): { yaw: number; pitch: number } {
  const d = direction.clone().normalize();
  return { yaw: Math.atan2(-d.z, d.x), pitch: clampPitch(Math.asin(d.y)) };
}

function clampPitch(pitch: number): number {
  return Math.max(-MAX_PITCH, Math.min(MAX_PITCH, pitch));
}

function wrapAngle(angle: number): number {
  return angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));
}
