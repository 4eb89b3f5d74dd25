// The scene as drawn: batches of static objects, instances, and bodies at the poses of the server.
import {
  Box3, DoubleSide, Group, InstancedBufferAttribute, InstancedMesh, Matrix4, Mesh, Quaternion, Ray, Vector3,
  type BufferGeometry, type Material, type MeshStandardMaterial,
} from "three";
import type { GLTF } from "three/examples/jsm/loaders/GLTFLoader.js";
import { MeshBVH } from "three-mesh-bvh";
import type { EntityTable } from "../world/entities";
import { EntityFlags, makeMaterial } from "./entity_material";
import type { Body } from "../generated/enfilade_pb";
import { mergePieces, sortMeshes, type Piece } from "../world/scene_file";
import { toVector, type Pose } from "../world/world_state";

interface Hit {
  entity: number;
  distance: number; // metres
  point: Vector3;
  normal: Vector3; // unit, on the side of the ray's origin
}

interface MovingPiece {
  mesh: InstancedMesh;
  index: number;
  body: number;
  bodyFromMesh: Matrix4; // at the initial pose, relative to the body's origin
}

const ONE = new Vector3(1, 1, 1);

export class SceneModel {
  readonly root = new Group();
  readonly flags: EntityFlags;
  readonly bounds = new Box3();
  readonly withoutEntity: number;
  readonly table: EntityTable;
  #boxes = new Map<number, Box3>(); // of objects, at the initial pose
  #meshes: Mesh[] = [];
  #moving: MovingPiece[] = [];
  #origins = new Map<number, Vector3>(); // of bodies
  #displaced = new Set<number>(); // bodies away from their initial pose
  #poses = new Map<number, Matrix4>();
  #trees = new Map<BufferGeometry, MeshBVH>();

  constructor(gltf: GLTF, table: EntityTable, bodies: Body[], maxId: number) {
    this.table = table;
    this.flags = new EntityFlags(maxId);
    for (const { id, coplanarRank } of table.byId.values()) this.flags.setCoplanarRank(id, coplanarRank);
    for (const body of bodies) this.#origins.set(body.id, toVector(body.origin));
    const file = sortMeshes(gltf, table);
    this.withoutEntity = file.withoutEntity;
    const materials = new Map<string, Material>();
    for (const mesh of [...file.batches, ...file.instances, ...mergePieces(file.loose)]) {
      mesh.material = this.#getMaterial(mesh.material as MeshStandardMaterial, mesh.geometry, materials);
      this.#addStatic(mesh);
    }
    this.#addMoving(file.moving, materials);
    for (const box of this.#boxes.values()) this.bounds.union(box);
    this.root.matrixAutoUpdate = false;
  }

  #getMaterial(source: MeshStandardMaterial, geometry: BufferGeometry, made: Map<string, Material>): Material {
    const hasColors = geometry.hasAttribute("color");
    const key = `${source.uuid} ${hasColors}`;
    const material = made.get(key) ?? makeMaterial(source, this.flags, hasColors);
    made.set(key, material);
    return material;
  }

  #addStatic(mesh: Mesh): void {
    mesh.matrix.copy(mesh.matrixWorld);
    mesh.matrixAutoUpdate = false;
    if (!mesh.geometry.hasAttribute("normal")) mesh.geometry.computeVertexNormals();
    this.root.add(mesh);
    this.#meshes.push(mesh);
    if (mesh instanceof InstancedMesh) this.#measureInstances(mesh);
    else this.#measureVertices(mesh);
  }

  /** Moving objects with the same mesh and material are instances of one drawing. */
  #addMoving(pieces: Piece[], materials: Map<string, Material>): void {
    const groups = new Map<string, Piece[]>();
    for (const piece of pieces) {
      const key = `${piece.geometry.uuid} ${piece.material.uuid}`;
      groups.set(key, [...(groups.get(key) ?? []), piece]);
    }
    for (const group of groups.values()) {
      const first = group[0]!;
      const geometry = first.geometry.clone();
      if (!geometry.hasAttribute("normal")) geometry.computeVertexNormals();
      const ids = new Float32Array(group.map((piece) => piece.entity));
      geometry.setAttribute("entityId", new InstancedBufferAttribute(ids, 1));
      const mesh = new InstancedMesh(geometry, this.#getMaterial(first.material, geometry, materials), group.length);
      mesh.frustumCulled = false; // bodies leave any box that is computed once
      group.forEach(({ entity, sceneFromMesh }, index) => {
        const body = this.table.bodyByObject.get(entity)!;
        const origin = this.#origins.get(body) ?? new Vector3();
        const bodyFromMesh = new Matrix4().makeTranslation(-origin.x, -origin.y, -origin.z).multiply(sceneFromMesh);
        this.#moving.push({ mesh, index, body, bodyFromMesh });
        mesh.setMatrixAt(index, sceneFromMesh);
      });
      this.root.add(mesh);
      this.#meshes.push(mesh);
      this.#measureInstances(mesh);
    }
  }

  #getBox(entity: number): Box3 {
    let box = this.#boxes.get(entity);
    if (!box) this.#boxes.set(entity, (box = new Box3()));
    return box;
  }

  #measureVertices(mesh: Mesh): void {
    const position = mesh.geometry.getAttribute("position");
    const ids = mesh.geometry.getAttribute("entityId");
    const v = new Vector3();
    for (let i = 0; i < position.count; ++i) {
      this.#getBox(ids.getX(i)).expandByPoint(v.fromBufferAttribute(position, i).applyMatrix4(mesh.matrixWorld));
    }
  }

  #measureInstances(mesh: InstancedMesh): void {
    mesh.geometry.computeBoundingBox();
    const ids = mesh.geometry.getAttribute("entityId");
    const matrix = new Matrix4();
    for (let i = 0; i < mesh.count; ++i) {
      mesh.getMatrixAt(i, matrix);
      const box = mesh.geometry.boundingBox!.clone().applyMatrix4(matrix.premultiply(mesh.matrixWorld));
      this.#getBox(ids.getX(i)).union(box);
    }
  }

  /** The box of an object at its initial pose; null if the object has no triangles. */
  findBox(entity: number): Box3 | null {
    return this.#boxes.get(entity) ?? null;
  }

  /** The box of an object where it is now. */
  findPresentBox(entity: number): Box3 | null {
    const box = this.#boxes.get(entity);
    const body = this.table.bodyByObject.get(entity);
    const pose = body === undefined ? undefined : this.#poses.get(body);
    const origin = body === undefined ? undefined : this.#origins.get(body);
    if (!box || !pose || !origin) return box ?? null;
    return box.clone().translate(origin.clone().negate()).applyMatrix4(pose);
  }

  getBoxes(): IterableIterator<[number, Box3]> {
    return this.#boxes.entries();
  }

  /** Moves the bodies to the given poses; all others return to their initial pose. */
  applyPoses(poses: Map<number, Pose>): void {
    let changed = false;
    const matrix = new Matrix4();
    const identity = new Quaternion();
    for (const id of new Set([...this.#displaced, ...poses.keys()])) {
      const pose = poses.get(id);
      const origin = this.#origins.get(id);
      if (!origin) continue;
      matrix.compose(pose?.position ?? origin, pose?.orientation ?? identity, ONE);
      const old = this.#poses.get(id);
      if (old?.equals(matrix)) continue;
      this.#poses.set(id, matrix.clone());
      if (pose) this.#displaced.add(id);
      else this.#displaced.delete(id);
      changed = true;
    }
    if (!changed) return;
    for (const { mesh, index, body, bodyFromMesh } of this.#moving) {
      const pose = this.#poses.get(body);
      if (!pose) continue;
      mesh.setMatrixAt(index, matrix.multiplyMatrices(pose, bodyFromMesh));
      mesh.instanceMatrix.needsUpdate = true;
    }
  }

  /** Builds the trees for rays in small pieces of time, so that the page stays responsive. */
  prepareRays(): void {
    const waiting = this.#meshes.map((mesh) => mesh.geometry);
    const next = () => {
      const geometry = waiting.pop();
      if (!geometry) return;
      this.#getTree(geometry);
      setTimeout(next, 0);
    };
    setTimeout(next, 200);
  }

  #getTree(geometry: BufferGeometry): MeshBVH {
    let tree = this.#trees.get(geometry);
    // An indirect tree leaves the triangles in their order.
    if (!tree) this.#trees.set(geometry, (tree = new MeshBVH(geometry, { indirect: true })));
    return tree;
  }

  /** The first visible object on a ray. Triangles are solid from both sides, as for the server. */
  raycast(origin: Vector3, direction: Vector3, reach = Infinity): Hit | null {
    const ray = new Ray(origin, direction.clone().normalize());
    let best: Hit | null = null;
    const matrix = new Matrix4();
    const take = (mesh: Mesh, sceneFromMesh: Matrix4, entityAt: (corner: number) => number) => {
      const hit = this.#castAt(mesh, sceneFromMesh, ray, best?.distance ?? reach, entityAt);
      if (hit) best = hit;
    };
    for (const mesh of this.#meshes) {
      const ids = mesh.geometry.getAttribute("entityId");
      if (mesh instanceof InstancedMesh) {
        for (let i = 0; i < mesh.count; ++i) {
          mesh.getMatrixAt(i, matrix);
          take(mesh, matrix.premultiply(mesh.matrixWorld), () => ids.getX(i));
        }
      } else {
        take(mesh, mesh.matrixWorld, (corner) => ids.getX(corner));
      }
    }
    return best;
  }

  #castAt(
    mesh: Mesh, sceneFromMesh: Matrix4, ray: Ray, reach: number, entityAt: (corner: number) => number,
  ): Hit | null {
    const { geometry } = mesh;
    if (!geometry.boundingSphere) geometry.computeBoundingSphere();
    const sphere = geometry.boundingSphere!.clone().applyMatrix4(sceneFromMesh);
    if (!ray.intersectsSphere(sphere)) return null;
    const local = ray.clone().applyMatrix4(sceneFromMesh.clone().invert());
    const tree = this.#getTree(geometry);
    const hits = this.flags.hiddenCount === 0
      ? [tree.raycastFirst(local, DoubleSide)] : tree.raycast(local, DoubleSide);
    let best: Hit | null = null;
    for (const hit of hits as ({ point: Vector3; face: { a: number; normal: Vector3 } } | null)[]) {
      if (!hit) continue;
      const point = hit.point.clone().applyMatrix4(sceneFromMesh);
      const distance = point.distanceTo(ray.origin);
      const entity = entityAt(hit.face.a);
      if (distance >= (best?.distance ?? reach) || this.flags.isHidden(entity)) continue;
      const normal = hit.face.normal.clone().transformDirection(sceneFromMesh);
      if (normal.dot(ray.direction) > 0) normal.negate();
      best = { entity, distance, point, normal };
    }
    return best;
  }

  dispose(): void {
    for (const mesh of this.#meshes) {
      mesh.geometry.dispose();
      (mesh.material as Material).dispose();
    }
    this.flags.dispose();
    this.root.removeFromParent();
  }
}
