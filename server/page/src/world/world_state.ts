// The states that the server sends, interpolated for display.
import { Quaternion, Vector3 } from "three";
import type { AvatarState, BodyState, State } from "../generated/enfilade_pb";

const DELAY = 0.05; // seconds of wall-clock time: three ticks, so that a late message stalls nothing
const KEPT_MILLISECONDS = 6; // less than a frame
const MAX_STATES = 64;
const FAR_JUMP = 4; // metres in one state: a teleport (Seek, spawn), not a motion

export interface Pose {
  position: Vector3;
  orientation: Quaternion;
}

export interface AvatarPose {
  state: AvatarState;
  feet: Vector3;
  gaze: Vector3;
  eyeHeight: number;
}

interface Received {
  state: State;
  at: number; // seconds, wall clock
}

export class WorldState {
  #received: Received[] = [];
  #avatars: AvatarPose[] = [];
  #avatarsAt = -Infinity; // milliseconds

  get latest(): State | null {
    return this.#received.at(-1)?.state ?? null;
  }

  clear(): void {
    this.#received = [];
    this.#avatarsAt = -Infinity;
  }

  add(state: State): void {
    const last = this.latest;
    if (last && state.tick < last.tick) this.clear(); // a Seek or a Restart
    this.#received.push({ state, at: performance.now() / 1000 });
    if (this.#received.length > MAX_STATES) this.#received.shift();
  }

  /** True while the displayed state is behind the latest one. */
  get isMoving(): boolean {
    const last = this.#received.at(-1);
    return !!last && performance.now() / 1000 - last.at < DELAY + 0.1;
  }

  /** The two states around the displayed time, and the fraction between them. */
  #findAround(): { from: State; to: State; fraction: number } | null {
    const count = this.#received.length;
    if (count === 0) return null;
    const shown = performance.now() / 1000 - DELAY;
    let next = count - 1;
    while (next > 0 && this.#received[next - 1]!.at > shown) --next;
    const to = this.#received[next]!;
    const from = this.#received[Math.max(0, next - 1)]!;
    const span = to.at - from.at;
    const fraction = span > 0 && span < 0.5 ? Math.min(1, Math.max(0, (shown - from.at) / span)) : 1;
    return { from: from.state, to: to.state, fraction };
  }

  /** The avatars at the displayed time. Several parts of the page ask in one frame: the reply is kept for it. */
  getAvatars(): AvatarPose[] {
    const now = performance.now();
    if (now - this.#avatarsAt > KEPT_MILLISECONDS) {
      this.#avatars = this.#interpolateAvatars();
      this.#avatarsAt = now;
    }
    return this.#avatars;
  }

  findAvatar(name: string): AvatarPose | undefined {
    return this.getAvatars().find(({ state }) => state.name === name);
  }

  #interpolateAvatars(): AvatarPose[] {
    const around = this.#findAround();
    if (!around) return [];
    const before = new Map(around.from.avatars.map((avatar) => [avatar.id, avatar]));
    return around.to.avatars.map((state) => {
      const old = before.get(state.id) ?? state;
      const feet = toVector(state.feet);
      const start = toVector(old.feet);
      const fraction = start.distanceTo(feet) > FAR_JUMP ? 1 : around.fraction;
      return {
        state,
        feet: start.lerp(feet, fraction),
        gaze: toVector(old.gaze).lerp(toVector(state.gaze), fraction).normalize(),
        eyeHeight: old.eyeHeight + (state.eyeHeight - old.eyeHeight) * fraction,
      };
    });
  }

  /** Poses of the bodies that have left their initial pose, by id. */
  getBodies(): Map<number, Pose> {
    const poses = new Map<number, Pose>();
    const around = this.#findAround();
    if (!around) return poses;
    const before = new Map(around.from.bodies.map((body) => [body.id, body]));
    for (const body of around.to.bodies) {
      const start = readPose(before.get(body.id) ?? body);
      const end = readPose(body);
      const fraction = start.position.distanceTo(end.position) > FAR_JUMP ? 1 : around.fraction;
      start.position.lerp(end.position, fraction);
      start.orientation.slerp(end.orientation, fraction);
      poses.set(body.id, start);
    }
    return poses;
  }
}

export function toVector(v: { x: number; y: number; z: number } | undefined): Vector3 {
  return v ? new Vector3(v.x, v.y, v.z) : new Vector3();
}

export function toPlain(v: Vector3): { x: number; y: number; z: number } {
  return { x: v.x, y: v.y, z: v.z };
}

function readPose(body: BodyState): Pose {
  const q = body.orientation;
  return {
    position: toVector(body.position),
    orientation: q ? new Quaternion(q.x, q.y, q.z, q.w) : new Quaternion(),
  };
}
