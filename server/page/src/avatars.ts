// Avatars as drawn: the bevelled prism with twelve sides that the server moves, with a face that shows the view
// direction. The server does not send radii or convex parts; every avatar is drawn with the default radius.
import {
  BoxGeometry, BufferGeometry, CanvasTexture, Color, Float32BufferAttribute, Group, Mesh, MeshLambertMaterial, Sprite,
  SpriteMaterial, Vector3,
} from "three";
import type { App } from "./app";
import type { CameraRig } from "./camera_rig";
import type { AvatarPose } from "./world_state";

const RADIUS = 0.3; // metres
const BEVEL_INSET = 0.25; // of the radius
const BEVEL_HEIGHT = 0.05; // metres
const SIDES = 12;
const NEAR_CAMERA = 1.6; // metres
const COLORS = [0x1f6f8b, 0xb5562b, 0x5b7f3a, 0x7a4f9a, 0xa8842c, 0x2f5aa8, 0x9c3d58, 0x3d8a76];

interface Figure {
  group: Group;
  body: Mesh;
  face: Mesh;
  height: number;
}

export function colorOf(id: number): string {
  return `#${new Color(COLORS[id % COLORS.length]!).getHexString()}`;
}

export class Avatars {
  #app: App;
  #rig: CameraRig;
  #figures = new Map<number, Figure>();
  #root = new Group();

  constructor(app: App, rig: CameraRig) {
    this.#app = app;
    this.#rig = rig;
    app.view.scene.add(this.#root);
    app.view.updaters.unshift(() => this.#update());
  }

  #update(): boolean {
    const { model, state } = this.#app;
    const poses = state.avatars();
    const present = new Set(poses.map((pose) => pose.state.id));
    for (const [id, figure] of this.#figures) {
      if (present.has(id)) continue;
      figure.group.removeFromParent();
      this.#figures.delete(id);
    }
    for (const pose of poses) this.#place(pose);
    model?.applyPoses(state.bodies());
    return state.isMoving;
  }

  #place(pose: AvatarPose): void {
    const { id, name, height } = pose.state;
    let figure = this.#figures.get(id);
    if (figure && figure.height !== height) {
      figure.group.removeFromParent();
      figure = undefined;
    }
    if (!figure) {
      figure = makeFigure(id, name, height || 1.75);
      figure.height = height;
      this.#figures.set(id, figure);
      this.#root.add(figure.group);
    }
    figure.group.position.copy(pose.feet);
    const yaw = Math.atan2(-pose.gaze.z, pose.gaze.x);
    figure.face.position.set(0.9 * RADIUS * Math.cos(yaw), pose.eyeHeight, -0.9 * RADIUS * Math.sin(yaw));
    figure.face.rotation.y = yaw;
    const isFocus = name === this.#app.focus;
    figure.group.visible = !(this.#rig.mode === "first" && isFocus);
    // A wall may push the camera so near that the avatar would fill the picture.
    const distance = this.#rig.position.distanceTo(figure.group.position.clone().setY(pose.feet.y + pose.eyeHeight));
    const material = figure.body.material as MeshLambertMaterial;
    const isNear = isFocus && distance < NEAR_CAMERA;
    material.opacity = isNear ? 0.3 : 1;
    if (material.transparent !== isNear) Object.assign(material, { transparent: isNear, depthWrite: !isNear, needsUpdate: true });
  }

  /** The nearest avatar on a ray; the avatar whose eyes the page shows is ignored. */
  raycast(origin: Vector3, direction: Vector3): { entity: number; distance: number; point: Vector3 } | null {
    let best: { entity: number; distance: number; point: Vector3 } | null = null;
    for (const { state, feet } of this.#app.state.avatars()) {
      if (this.#rig.mode === "first" && state.name === this.#app.focus) continue;
      const distance = cylinderDistance(origin, direction, feet, RADIUS, state.height || 1.75);
      if (distance === null || distance >= (best?.distance ?? Infinity)) continue;
      best = { entity: state.id, distance, point: origin.clone().addScaledVector(direction, distance) };
    }
    return best;
  }
}

function makeFigure(id: number, name: string, height: number): Figure {
  const group = new Group();
  const color = new Color(COLORS[id % COLORS.length]!);
  const body = new Mesh(prismGeometry(height), new MeshLambertMaterial({ color, flatShading: true }));
  const face = new Mesh(new BoxGeometry(0.14, 0.09, 0.3), new MeshLambertMaterial({ color: 0x20262b }));
  group.add(body, face, nameSprite(name, height));
  return { group, body, face, height };
}

function prismGeometry(height: number): BufferGeometry {
  const inner = RADIUS * (1 - BEVEL_INSET);
  const rings: [number, number][] = [[0, inner], [BEVEL_HEIGHT, RADIUS], [height - BEVEL_HEIGHT, RADIUS], [height, inner]];
  const at = (ring: number, side: number) => {
    const [y, r] = rings[ring]!;
    const angle = (2 * Math.PI * side) / SIDES;
    return [r * Math.cos(angle), y, r * Math.sin(angle)];
  };
  const positions: number[] = [];
  for (let side = 0; side < SIDES; ++side) {
    for (let ring = 0; ring < 3; ++ring) {
      positions.push(...at(ring, side), ...at(ring + 1, side), ...at(ring + 1, side + 1));
      positions.push(...at(ring, side), ...at(ring + 1, side + 1), ...at(ring, side + 1));
    }
    positions.push(0, height, 0, ...at(3, side + 1), ...at(3, side));
    positions.push(0, 0, 0, ...at(0, side), ...at(0, side + 1));
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(positions, 3));
  geometry.computeVertexNormals();
  return geometry;
}

function nameSprite(name: string, height: number): Sprite {
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
  sprite.position.y = height + 0.15;
  sprite.center.y = 0;
  return sprite;
}

function cylinderDistance(origin: Vector3, d: Vector3, feet: Vector3, radius: number, height: number): number | null {
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
