// The share link: camera and tick in the fragment of the address. A fragment never reaches the server's log.
import { Vector3 } from "three";
import type { CameraRig } from "../view/camera_rig";

interface SharedView {
  position: Vector3;
  yaw: number;
  pitch: number;
  tick: number | null;
}

export function makeShareLink(rig: CameraRig, tick: number): string {
  const { x, y, z } = rig.position;
  const numbers = [x, y, z].map((v) => v.toFixed(3)).concat([rig.yaw, rig.pitch].map((v) => v.toFixed(4)));
  const link = new URL(location.href);
  link.hash = `camera=${numbers.join(",")}&tick=${tick}`;
  return link.href;
}

export function readSharedView(): SharedView | null {
  const fields = new URLSearchParams(location.hash.slice(1));
  const numbers = (fields.get("camera") ?? "").split(",").map(Number);
  if (numbers.length !== 5 || !numbers.every(Number.isFinite)) return null;
  const [x, y, z, yaw, pitch] = numbers as [number, number, number, number, number];
  const tick = Number.parseInt(fields.get("tick") ?? "", 10);
  return { position: new Vector3(x, y, z), yaw, pitch, tick: Number.isFinite(tick) ? tick : null };
}
