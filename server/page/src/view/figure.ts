// The drawn shapes of avatars: a figure as in an architect's model, and the prism that the server moves.
import {
  BoxGeometry, BufferGeometry, CylinderGeometry, Float32BufferAttribute, LatheGeometry, Matrix4, SphereGeometry, Vector2,
} from "three";
import { mergeGeometries } from "three/examples/jsm/utils/BufferGeometryUtils.js";

export const FIGURE_HEIGHT = 1.75; // metres; other avatars are scaled
export const PRISM_RADIUS = 0.3; // metres; the server does not send radii or convex parts
const BEVEL_INSET = 0.25; // of the radius
const BEVEL_HEIGHT = 0.05; // metres
const SIDES = 12;
const DEPTH = 0.62; // of the body, relative to its width

// Half widths of the body from the hips to the neck: [height, half width], metres.
const BODY: [number, number][] = [
  [0.76, 0], [0.78, 0.13], [0.88, 0.175], [1.06, 0.145], [1.28, 0.2], [1.4, 0.205], [1.455, 0.15], [1.48, 0.06], [1.54, 0.052],
];

/** A standing person, the feet at the origin, facing +x. */
export function makeFigureGeometry(): BufferGeometry {
  const body = new LatheGeometry(BODY.map(([y, r]) => new Vector2(r, y)), 20);
  body.applyMatrix4(new Matrix4().makeScale(DEPTH, 1, 1));
  const head = new SphereGeometry(0.105, 18, 14);
  head.applyMatrix4(new Matrix4().makeScale(0.95, 1.2, 0.85).setPosition(0.01, 1.624, 0));
  const parts: BufferGeometry[] = [body, head];
  for (const side of [-1, 1]) {
    parts.push(makeLimb(0.082, 0.05, [0, 0.86, side * 0.088], [0, 0.06, side * 0.1]));
    parts.push(makeLimb(0.05, 0.036, [0, 1.41, side * 0.205], [0.02, 1.1, side * 0.262]));
    parts.push(makeLimb(0.036, 0.03, [0.02, 1.1, side * 0.262], [0.07, 0.82, side * 0.265]));
    const foot = new BoxGeometry(0.24, 0.065, 0.085);
    foot.translate(0.05, 0.0325, side * 0.102);
    parts.push(foot);
  }
  return mergeGeometries(parts.map((part) => part.toNonIndexed()))!;
}

/** A tapered cylinder between two points, with its radii there. */
function makeLimb(upper: number, lower: number, from: [number, number, number], to: [number, number, number]): BufferGeometry {
  const [x, y, z] = from;
  const height = y - to[1];
  const cylinder = new CylinderGeometry(upper, lower, height, 10);
  // A shear keeps the ends level.
  const shear = new Matrix4().set(1, (x - to[0]) / height, 0, (x + to[0]) / 2, 0, 1, 0, (y + to[1]) / 2, 0, (z - to[2]) / height, 1, (z + to[2]) / 2, 0, 0, 0, 1);
  return cylinder.applyMatrix4(shear);
}

export function makePrismGeometry(): BufferGeometry {
  const inner = PRISM_RADIUS * (1 - BEVEL_INSET);
  const rings: [number, number][] = [[0, inner], [BEVEL_HEIGHT, PRISM_RADIUS], [FIGURE_HEIGHT - BEVEL_HEIGHT, PRISM_RADIUS], [FIGURE_HEIGHT, inner]];
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
    positions.push(0, FIGURE_HEIGHT, 0, ...at(3, side + 1), ...at(3, side));
    positions.push(0, 0, 0, ...at(0, side), ...at(0, side + 1));
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(positions, 3));
  geometry.computeVertexNormals();
  return geometry;
}
