// Reads the scene's GLB file: finds the entity of every mesh and sorts meshes into batches of static objects,
// instances, and moving bodies. Files without entity ids (plain GLB files) are matched by paths.
import {
  BufferAttribute, BufferGeometry, InstancedBufferAttribute, InstancedMesh, Matrix3, Matrix4, Mesh, Vector3,
  type Material, type MeshStandardMaterial, type Object3D,
} from "three";
import { GLTFLoader, type GLTF } from "three/examples/jsm/loaders/GLTFLoader.js";
import type { EntityTable } from "./entities";

/** A mesh of one object, in the scene's axes at the initial pose. */
export interface Piece {
  geometry: BufferGeometry;
  material: MeshStandardMaterial;
  sceneFromMesh: Matrix4;
  entity: number;
}

interface SceneFile {
  batches: Mesh[]; // with a per-vertex attribute entityId
  instances: InstancedMesh[]; // with a per-instance attribute entityId
  loose: Piece[]; // static objects with meshes of their own
  moving: Piece[]; // objects of bodies
  withoutEntity: number; // meshes that belong to no entity; they are not drawn
}

/** Fetches the file and reports the received bytes. */
export async function fetchScene(url: string, token: string, progress: (bytes: number) => void): Promise<ArrayBuffer> {
  const headers: HeadersInit = token ? { Authorization: `Bearer ${token}` } : {};
  const reply = await fetch(url, { headers, cache: "no-cache" });
  if (!reply.ok || !reply.body) {
    throw new Error(`The server does not send the scene (${reply.status} ${reply.statusText}).`);
  }
  const chunks: Uint8Array[] = [];
  let bytes = 0;
  const reader = reply.body.getReader();
  for (;;) {
    const { done, value } = await reader.read();
    if (done) break;
    chunks.push(value);
    progress(bytes += value.length);
  }
  return await new Blob(chunks as BlobPart[]).arrayBuffer();
}

export async function parseScene(bytes: ArrayBuffer): Promise<GLTF> {
  return await new GLTFLoader().parseAsync(bytes, "");
}

interface Described {
  extras?: Record<string, unknown>;
  name?: string;
}

/** Adds the file's tables of entities (extras of scenes and nodes) to the table. */
export function readEntities(gltf: GLTF, table: EntityTable): void {
  const json = gltf.parser.json as { scenes?: Described[]; nodes?: Described[] };
  for (const { extras } of json.scenes ?? []) table.addStructure(extras?.storeys, extras?.spaces);
  for (const { extras, name } of [...(json.scenes ?? []), ...(json.nodes ?? [])]) {
    // Nodes may also list the numbers of their entities; only records describe them.
    if (Array.isArray(extras?.entities)) extras.entities.forEach((record) => table.addRecord(record));
    // A node may only repeat the number of an entity that a table describes.
    const isDescribed = extras?.path !== undefined || extras?.class !== undefined;
    if (isDescribed && !table.byId.has(Number(extras?.entity))) table.addRecord({ name, ...extras });
  }
}

export function sortMeshes(gltf: GLTF, table: EntityTable): SceneFile {
  const found: SceneFile = { batches: [], instances: [], loose: [], moving: [], withoutEntity: 0 };
  gltf.scene.updateMatrixWorld(true);
  const paths = findPaths(gltf);
  gltf.scene.traverse((object) => {
    if (!(object instanceof Mesh)) return;
    const ids = findEntityAttribute(object.geometry);
    if (ids) {
      addIds(object, ids);
      if (object instanceof InstancedMesh) found.instances.push(object);
      else found.batches.push(object);
    } else {
      const entity = findEntity(object, paths, table);
      if (entity === 0) ++found.withoutEntity;
      else (table.bodyByObject.has(entity) ? found.moving : found.loose).push(...makePieces(object, entity));
    }
  });
  return found;
}

function findEntityAttribute(geometry: BufferGeometry): BufferAttribute | null {
  return (geometry.getAttribute("_entity_id") ?? geometry.getAttribute("_ENTITY_ID") ?? null) as BufferAttribute | null;
}

/** Renames the ids of the file, and makes them numbers that a shader can read. */
function addIds(mesh: Mesh, ids: BufferAttribute): void {
  const numbers = Float32Array.from({ length: ids.count }, (_, i) => ids.getX(i));
  const { geometry } = mesh;
  geometry.deleteAttribute("_entity_id");
  geometry.deleteAttribute("_ENTITY_ID");
  const Attribute = mesh instanceof InstancedMesh ? InstancedBufferAttribute : BufferAttribute;
  geometry.setAttribute("entityId", new Attribute(numbers, 1));
}

/** An object with a mesh of its own; an instanced one has a piece per instance. */
function makePieces(mesh: Mesh, entity: number): Piece[] {
  const material = mesh.material as MeshStandardMaterial;
  const { geometry } = mesh;
  if (!(mesh instanceof InstancedMesh)) {
    return [{ geometry, material, sceneFromMesh: mesh.matrixWorld.clone(), entity }];
  }
  return Array.from({ length: mesh.count }, (_, i) => {
    const sceneFromMesh = new Matrix4();
    mesh.getMatrixAt(i, sceneFromMesh);
    return { geometry, material, sceneFromMesh: sceneFromMesh.premultiply(mesh.matrixWorld), entity };
  });
}

/** The entity of a mesh: the number of its node or of the nearest node above it, else that of its path. */
function findEntity(mesh: Object3D, paths: Map<Object3D, string>, table: EntityTable): number {
  for (let node: Object3D | null = mesh; node; node = node.parent) {
    const { entity } = node.userData as { entity?: unknown };
    if (typeof entity === "number") return entity;
  }
  for (let node: Object3D | null = mesh; node; node = node.parent) {
    const path = paths.get(node) ?? "";
    // A body described in another file has a name without the root of the scene.
    const found = table.byPath.get(path) ?? table.byPath.get(path.slice(path.indexOf("/") + 1));
    if (found) return found.id;
  }
  return 0;
}

/** The paths of all nodes by the names in the file. The loader changes names, so they are read from the JSON. */
function findPaths(gltf: GLTF): Map<Object3D, string> {
  const { nodes = [] } = gltf.parser.json as { nodes?: { name?: string }[] };
  const paths = new Map<Object3D, string>();
  const visit = (object: Object3D, above: string) => {
    const index = gltf.parser.associations.get(object)?.nodes;
    let path = above;
    if (index !== undefined) {
      const name = nodes[index]?.name ?? "";
      path = above && name ? `${above}/${name}` : above || name;
      paths.set(object, path);
    }
    object.children.forEach((child) => visit(child, path));
  };
  visit(gltf.scene, "");
  return paths;
}

/** Merges pieces with the same material into one mesh each. */
export function mergePieces(pieces: Piece[]): Mesh[] {
  const groups = new Map<Material, Piece[]>();
  for (const piece of pieces) {
    const group = groups.get(piece.material);
    if (group) group.push(piece);
    else groups.set(piece.material, [piece]);
  }
  return [...groups].map(([material, group]) => new Mesh(mergeGeometry(group), material));
}

function mergeGeometry(pieces: Piece[]): BufferGeometry {
  let vertices = 0;
  let corners = 0;
  for (const { geometry } of pieces) {
    if (!geometry.getAttribute("normal")) geometry.computeVertexNormals();
    vertices += geometry.getAttribute("position").count;
    corners += geometry.index?.count ?? geometry.getAttribute("position").count;
  }
  const hasUv = pieces.some(({ material, geometry }) => material.map && geometry.getAttribute("uv"));
  const positions = new Float32Array(3 * vertices);
  const normals = new Float32Array(3 * vertices);
  const ids = new Float32Array(vertices);
  const uvs = hasUv ? new Float32Array(2 * vertices) : null;
  const index = new Uint32Array(corners);

  let vertex = 0;
  let corner = 0;
  const v = new Vector3();
  const normalMatrix = new Matrix3();
  for (const { geometry, sceneFromMesh, entity } of pieces) {
    const position = geometry.getAttribute("position");
    const normal = geometry.getAttribute("normal");
    const uv = geometry.getAttribute("uv");
    normalMatrix.getNormalMatrix(sceneFromMesh);
    for (let i = 0; i < position.count; ++i) {
      v.fromBufferAttribute(position, i).applyMatrix4(sceneFromMesh).toArray(positions, 3 * (vertex + i));
      v.fromBufferAttribute(normal, i).applyNormalMatrix(normalMatrix).toArray(normals, 3 * (vertex + i));
      if (uvs && uv) uvs.set([uv.getX(i), uv.getY(i)], 2 * (vertex + i));
    }
    ids.fill(entity, vertex, vertex + position.count);
    const count = geometry.index?.count ?? position.count;
    const isMirrored = sceneFromMesh.determinant() < 0;
    for (let i = 0; i < count; ++i) {
      const source = isMirrored ? i - (i % 3) + (2 - (i % 3)) : i;
      index[corner + i] = vertex + (geometry.index ? geometry.index.getX(source) : source);
    }
    vertex += position.count;
    corner += count;
  }

  const merged = new BufferGeometry();
  merged.setAttribute("position", new BufferAttribute(positions, 3));
  merged.setAttribute("normal", new BufferAttribute(normals, 3));
  merged.setAttribute("entityId", new BufferAttribute(ids, 1));
  if (uvs) merged.setAttribute("uv", new BufferAttribute(uvs, 2));
  merged.setIndex(new BufferAttribute(index, 1));
  return merged;
}
