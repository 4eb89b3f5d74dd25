// Avatars as drawn: figures that face the view direction and, on request, the prisms that the server moves.
import {
  CanvasTexture, Color, DynamicDrawUsage, InstancedMesh, Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial,
  Quaternion, Sprite, SpriteMaterial, Vector3,
} from "three";
import type { App } from "../app";
import type { CameraRig } from "./camera_rig";
import { FIGURE_HEIGHT, makeFigureGeometry, makePrismGeometry, PRISM_RADIUS } from "./figure";
import type { AvatarPose } from "../world/world_state";

const NEAR_CAMERA = 1.6; // metres
const MAX_LABELS = 16; // the nearest avatars
const LABEL_DISTANCE = 30; // metres
const UP = new Vector3(0, 1, 0);
const COLORS = [0x1f6f8b, 0xb5562b, 0x5b7f3a, 0x7a4f9a, 0xa8842c, 0x2f5aa8, 0x9c3d58, 0x3d8a76];

export function findCssColor(id: number): string {
  return `#${findColor(id).getHexString()}`;
}

function findColor(id: number): Color {
  return new Color(COLORS[id % COLORS.length]!);
}

export class Avatars {
  #app: App;
  #rig: CameraRig;
  // All avatars are two drawings, so that a thousand of them cost no more calls than one.
  #figures: InstancedMesh | null = null;
  #prisms: InstancedMesh | null = null;
  // The avatar in focus is drawn alone, because it may become transparent.
  #own = new Mesh(makeFigureGeometry(), new MeshLambertMaterial());
  #labels = new Map<number, Sprite>();
  /** Also draws the shapes that collide. */
  prismsShown = false;

  constructor(app: App, rig: CameraRig) {
    this.#app = app;
    this.#rig = rig;
    app.view.scene.add(this.#own);
    app.view.updaters.unshift(() => this.#update());
  }

  #update(): boolean {
    const { model, state } = this.#app;
    const poses = state.getAvatars();
    this.#reserve(poses.length);
    this.#own.visible = false;
    let count = 0;
    for (const pose of poses) count += this.#place(pose, count) ? 1 : 0;
    for (const mesh of [this.#figures!, this.#prisms!]) {
      mesh.count = count;
      mesh.instanceMatrix.needsUpdate = true;
      if (mesh.instanceColor) mesh.instanceColor.needsUpdate = true;
    }
    this.#prisms!.visible = this.prismsShown;
    this.#placeLabels(poses);
    model?.applyPoses(state.getBodies());
    return state.isMoving;
  }

  #reserve(count: number): void {
    if (this.#figures && this.#figures.instanceMatrix.count >= count) return;
    this.#figures?.removeFromParent();
    this.#prisms?.removeFromParent();
    const capacity = Math.max(8, 2 * count);
    this.#figures = new InstancedMesh(makeFigureGeometry(), new MeshLambertMaterial(), capacity);
    const glass = new MeshBasicMaterial({ transparent: true, opacity: 0.3, depthWrite: false });
    this.#prisms = new InstancedMesh(makePrismGeometry(), glass, capacity);
    for (const mesh of [this.#figures, this.#prisms]) {
      mesh.frustumCulled = false;
      mesh.instanceMatrix.setUsage(DynamicDrawUsage);
      this.#app.view.scene.add(mesh);
    }
  }

  /** Writes the avatar into the drawings; false: its eyes are the camera. */
  #place(pose: AvatarPose, index: number): boolean {
    const { id, name, height } = pose.state;
    const isFocus = name === this.#app.focus;
    if (isFocus && this.#rig.mode === "first") return false;
    const scale = new Vector3(1, (height || FIGURE_HEIGHT) / FIGURE_HEIGHT, 1);
    const facing = new Quaternion().setFromAxisAngle(UP, Math.atan2(-pose.gaze.z, pose.gaze.x));
    this.#figures!.setMatrixAt(index, new Matrix4().compose(pose.feet, facing, isFocus ? new Vector3(0, 0, 0) : scale));
    this.#prisms!.setMatrixAt(index, new Matrix4().compose(pose.feet, new Quaternion(), scale));
    for (const mesh of [this.#figures!, this.#prisms!]) mesh.setColorAt(index, findColor(id));
    if (isFocus) this.#placeOwn(pose, facing, scale);
    return true;
  }

  #placeOwn(pose: AvatarPose, facing: Quaternion, scale: Vector3): void {
    this.#own.visible = true;
    this.#own.position.copy(pose.feet);
    this.#own.quaternion.copy(facing);
    this.#own.scale.copy(scale);
    const material = this.#own.material as MeshLambertMaterial;
    material.color = findColor(pose.state.id);
    // A wall may push the camera so near that the avatar would fill the picture.
    const eyes = pose.feet.clone().setY(pose.feet.y + pose.eyeHeight);
    const isNear = this.#rig.position.distanceTo(eyes) < NEAR_CAMERA;
    material.opacity = isNear ? 0.3 : 1;
    if (material.transparent !== isNear) Object.assign(material, { transparent: isNear, depthWrite: !isNear, needsUpdate: true });
  }

  #placeLabels(poses: AvatarPose[]): void {
    const eye = this.#rig.position;
    const near = poses
      .filter(({ state }) => !(state.name === this.#app.focus && this.#rig.mode === "first"))
      .map((pose) => ({ pose, distance: pose.feet.distanceTo(eye) }))
      .filter(({ distance }) => distance < LABEL_DISTANCE)
      .sort((a, b) => a.distance - b.distance).slice(0, MAX_LABELS);
    const shown = new Set(near.map(({ pose }) => pose.state.id));
    for (const [id, sprite] of this.#labels) {
      if (shown.has(id)) continue;
      sprite.removeFromParent();
      sprite.material.map?.dispose();
      sprite.material.dispose();
      this.#labels.delete(id);
    }
    for (const { pose } of near) {
      let sprite = this.#labels.get(pose.state.id);
      if (!sprite) {
        sprite = makeNameSprite(pose.state.name);
        this.#labels.set(pose.state.id, sprite);
        this.#app.view.scene.add(sprite);
      }
      sprite.position.copy(pose.feet).setY(pose.feet.y + (pose.state.height || FIGURE_HEIGHT) + 0.15);
    }
  }

  /** The nearest avatar on a ray; the avatar whose eyes the page shows is ignored. */
  raycast(origin: Vector3, direction: Vector3): { entity: number; distance: number; point: Vector3 } | null {
    let best: { entity: number; distance: number; point: Vector3 } | null = null;
    for (const { state, feet } of this.#app.state.getAvatars()) {
      if (this.#rig.mode === "first" && state.name === this.#app.focus) continue;
      const distance = intersectCylinder(origin, direction, feet, PRISM_RADIUS, state.height || FIGURE_HEIGHT);
      if (distance === null || distance >= (best?.distance ?? Infinity)) continue;
      best = { entity: state.id, distance, point: origin.clone().addScaledVector(direction, distance) };
    }
    return best;
  }
}

function makeNameSprite(name: string): Sprite {
  const canvas = document.createElement("canvas");
  canvas.width = 256;
  canvas.height = 48;
  const context = canvas.getContext("2d")!;
  context.font = "600 25px system-ui, sans-serif";
  const width = Math.min(250, context.measureText(name).width + 24);
  context.fillStyle = "rgba(255,255,255,0.88)";
  context.beginPath();
  context.roundRect((256 - width) / 2, 4, width, 40, 10);
  context.fill();
  context.fillStyle = "#20303c";
  context.textAlign = "center";
  context.fillText(name, 128, 33, 240);
  const sprite = new Sprite(new SpriteMaterial({ map: new CanvasTexture(canvas), depthWrite: false, sizeAttenuation: false }));
  sprite.scale.set(0.2, 0.0375, 1); // of the picture, at every distance
  sprite.center.y = 0;
  return sprite;
}

function intersectCylinder(origin: Vector3, d: Vector3, feet: Vector3, radius: number, height: number): number | null {
  const x = origin.x - feet.x;
  const z = origin.z - feet.z;
  const a = d.x * d.x + d.z * d.z;
  const b = x * d.x + z * d.z;
  const root = b * b - a * (x * x + z * z - radius * radius);
  if (a < 1e-12 || root < 0) return null;
  const t = (-b - Math.sqrt(root)) / a;
  const y = origin.y + t * d.y - feet.y;
  return t > 0 && y >= 0 && y <= height ? t : null;
}
