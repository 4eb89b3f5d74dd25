// Start places: free places on the floor of rooms in the middle of the scene. Scenes differ, so the places are only
// proposals; the server decides whether an avatar fits.
import { Box3, Vector3 } from "three";
import type { SceneModel } from "../view/scene";

export interface StartPlace {
  feet: Vector3;
  facing: Vector3; // horizontal unit vector of the longest view that ends at something
}

const RINGS = 9;
const SPACING = 1.7; // metres between tried places
const DIRECTIONS = 12;
const HEAD_ROOM = 1.9; // metres
const ROOM_HEIGHT = 12; // metres; below a higher ceiling counts as outdoors
const MAX_ROOMS = 12;
const MAX_VIEW = 15; // metres; farther views make a place no better
const MAX_SIGHT = 60; // metres; a direction with nothing within is empty

/** Places in order of preference. `around` is tried first; without it, the best of the largest rooms that the file names. */
export function proposeStarts(model: SceneModel, around: Vector3 | null): StartPlace[] {
  const middle = findMiddle(model);
  if (!around) {
    const rooms = [...model.table.rooms].sort((a, b) => b.area - a.area).slice(0, MAX_ROOMS);
    const judged = rooms.flatMap(({ floor }) => judge(model, new Vector3(floor.x, floor.y + 1, floor.z), middle) ?? []);
    if (judged.length > 0) return judged.sort((a, b) => b.score - a.score).map(({ place }) => place);
  }
  const center = around ?? middle;
  const scored: { place: StartPlace; score: number }[] = [];
  for (let ring = 0; ring <= RINGS; ++ring) {
    const count = ring === 0 ? 1 : 6 * ring;
    for (let i = 0; i < count; ++i) {
      const angle = (2 * Math.PI * i) / count;
      const at = center.clone().add(new Vector3(ring * SPACING * Math.cos(angle), 0, ring * SPACING * Math.sin(angle)));
      const found = judge(model, at, middle);
      if (found) scored.push({ place: found.place, score: found.score - (around ? 1.5 : 0.15) * ring });
    }
    if (scored.length >= 40) break;
  }
  return scored.sort((a, b) => b.score - a.score).map(({ place }) => place);
}

/** The middle of most objects, one metre above the lowest floor there. A large site has few objects. */
function findMiddle(model: SceneModel): Vector3 {
  const centers: Vector3[] = [];
  for (const [, box] of model.getBoxes()) centers.push(box.getCenter(new Vector3()));
  const median = (axis: "x" | "y" | "z") => centers.map((c) => c[axis]).sort((a, b) => a - b)[centers.length >> 1] ?? 0;
  const middle = new Vector3(median("x"), median("y"), median("z"));
  const area = new Box3().setFromCenterAndSize(middle, new Vector3(8, 1e4, 8));
  let floor = Infinity;
  for (const [, box] of model.getBoxes()) {
    const isFlat = box.max.y - box.min.y < 0.6 && (box.max.x - box.min.x) * (box.max.z - box.min.z) > 4;
    if (isFlat && box.intersectsBox(area)) floor = Math.min(floor, box.max.y);
  }
  if (Number.isFinite(floor)) middle.y = floor + 1;
  return middle;
}

function judge(model: SceneModel, at: Vector3, middle: Vector3): { place: StartPlace; score: number } | null {
  const floor = model.raycast(at, new Vector3(0, -1, 0), 4);
  if (!floor || floor.normal.y < 0.9) return null;
  const ceiling = model.raycast(at, new Vector3(0, 1, 0), ROOM_HEIGHT);
  if (ceiling && at.y - floor.point.y + ceiling.distance < HEAD_ROOM) return null;
  const eyes = floor.point.clone().add(new Vector3(0, 1.1, 0));
  let longest = 0;
  let shortest = MAX_VIEW;
  let sum = 0;
  const facing = middle.clone().sub(eyes).setY(0); // if every direction is empty
  if (facing.lengthSq() < 1e-6) facing.set(1, 0, 0);
  facing.normalize();
  for (let i = 0; i < DIRECTIONS; ++i) {
    const angle = (2 * Math.PI * i) / DIRECTIONS;
    const direction = new Vector3(Math.cos(angle), 0, -Math.sin(angle));
    const seen = model.raycast(eyes, direction, MAX_SIGHT);
    const free = Math.min(seen?.distance ?? MAX_VIEW, MAX_VIEW);
    sum += Math.min(free, 6);
    shortest = Math.min(shortest, free);
    if (seen && free > longest) {
      longest = free;
      facing.copy(direction);
    }
  }
  if (shortest < 0.45) return null;
  const score = sum / DIRECTIONS + 0.25 * Math.min(longest, 12) + Math.min(shortest, 1) + (ceiling ? 4 : 0);
  return { place: { feet: floor.point.clone().add(new Vector3(0, 0.002, 0)), facing }, score };
}
