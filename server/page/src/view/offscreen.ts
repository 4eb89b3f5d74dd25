// Pictures of the scene that are read back: the plan, and the picture of entity ids.
import {
  DoubleSide, ShaderMaterial, WebGLRenderTarget, type Camera, type Object3D, type PerspectiveCamera, type Scene,
  type WebGLRenderer,
} from "three";
import { VERTEX_BODY, VERTEX_HEAD } from "./entity_material";
import type { SceneModel } from "./scene";

/** Renders one child of a scene with one material. Rows run from the top, 4 bytes per pixel; the background is 0. */
export function renderOffscreen(
  renderer: WebGLRenderer, root: Object3D, camera: Camera, material: ShaderMaterial, width: number, height: number,
): Uint8ClampedArray<ArrayBuffer> {
  const target = new WebGLRenderTarget(width, height);
  const scene = root.parent as Scene;
  const others = scene.children.filter((child) => child !== root && child.visible);
  const { background, fog } = scene;
  const alpha = renderer.getClearAlpha();
  others.forEach((child) => (child.visible = false));
  Object.assign(scene, { overrideMaterial: material, background: null, fog: null });
  camera.updateMatrixWorld();
  renderer.setRenderTarget(target);
  renderer.setClearColor(0x000000, 0);
  renderer.clear();
  renderer.render(scene, camera);
  const raw = new Uint8Array(4 * width * height);
  renderer.readRenderTargetPixels(target, 0, 0, width, height, raw);
  renderer.setRenderTarget(null);
  renderer.setClearAlpha(alpha);
  Object.assign(scene, { overrideMaterial: null, background, fog });
  others.forEach((child) => (child.visible = true));
  target.dispose();
  const pixels = new Uint8ClampedArray(raw.length);
  for (let row = 0; row < height; ++row) {
    pixels.set(raw.subarray(4 * width * row, 4 * width * (row + 1)), 4 * width * (height - 1 - row));
  }
  return pixels;
}

const IDS_VERTEX = `${VERTEX_HEAD}
flat varying float id;
void main() {
  vec4 p = vec4(position, 1.0);
  #ifdef USE_INSTANCING
    p = instanceMatrix * p;
  #endif
  id = entityId;
  gl_Position = projectionMatrix * modelViewMatrix * p;
${VERTEX_BODY}}
`;
const IDS_FRAGMENT = `
flat varying float id;
void main() {
  float whole = floor(id + 0.5);
  gl_FragColor = vec4(mod(whole, 256.0), mod(floor(whole / 256.0), 256.0), floor(whole / 65536.0), 255.0) / 255.0;
}
`;

/** The entity of each pixel, rows from the top; 0: background. Transparent objects count as solid, hidden ones not. */
export function renderIds(
  renderer: WebGLRenderer, model: SceneModel, camera: PerspectiveCamera, width: number, height: number,
): Uint32Array {
  const view = camera.clone();
  view.aspect = width / height;
  view.updateProjectionMatrix();
  const material = new ShaderMaterial({
    vertexShader: IDS_VERTEX, fragmentShader: IDS_FRAGMENT, side: DoubleSide,
    uniforms: { entityFlags: { value: model.flags.texture } },
  });
  const pixels = renderOffscreen(renderer, model.root, view, material, width, height);
  material.dispose();
  const ids = new Uint32Array(width * height);
  for (let i = 0; i < ids.length; ++i) ids[i] = pixels[4 * i]! + 256 * pixels[4 * i + 1]! + 65536 * pixels[4 * i + 2]!;
  return ids;
}
