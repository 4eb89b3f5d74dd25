// The table of entities: objects of the scene by id, with path, class, GlobalId and storey.
import { Entity_Kind } from "../generated/enfilade_pb";
import type { WorldSource } from "./source";

export interface Entity {
  id: number;
  path: string;
  globalId: string;
  class: string;
  storey: string;
  coplanarRank: number; // of surfaces in one plane the lowest is visible
}

const IDS_PER_REQUEST = 20_000; // replies then stay far below 8 MiB

/** A room of the file: the middle of its floor, and its area. */
interface Room {
  floor: { x: number; y: number; z: number };
  area: number; // square metres of its box
}

export class EntityTable {
  readonly byId = new Map<number, Entity>();
  readonly byPath = new Map<string, Entity>();
  storeys: string[] = []; // names, from the lowest one up
  rooms: Room[] = [];
  readonly avatars = new Map<number, string>(); // names, by entity id; a name stays after its avatar left
  /** Every object of a moving body, and the id of that body. */
  readonly bodyByObject = new Map<number, number>();

  add(entity: Entity): void {
    this.byId.set(entity.id, entity);
    this.byPath.set(entity.path, entity);
  }

  /** The name that a person reads: the path of an object, or the name of an avatar. */
  findName(id: number): string {
    return this.byId.get(id)?.path ?? this.avatars.get(id) ?? `entity ${id}`;
  }

  /** Takes a record of a scene file. Unknown or wrong fields are left out. */
  addRecord(record: unknown): void {
    if (typeof record !== "object" || record === null) return;
    const fields = record as Record<string, unknown>;
    const id = Number(fields.entity ?? fields.id);
    if (!Number.isInteger(id) || id <= 0) return;
    const path = toText(fields.path) || toText(fields.name) || `object ${id}`;
    const coplanarRank = Math.min(255, Math.max(0, Math.trunc(Number(fields.coplanarRank ?? 0)) || 0));
    this.add({
      id, path, globalId: toText(fields.globalId), class: toText(fields.class), storey: toText(fields.storey), coplanarRank,
    });
  }

  /** Takes the storeys and spaces of a scene file. Unknown or wrong fields are left out. */
  addStructure(storeys: unknown, spaces: unknown): void {
    const toList = (value: unknown) => (Array.isArray(value) ? value : []) as Record<string, unknown>[];
    const isPoint = (value: unknown): value is number[] => Array.isArray(value) && value.length === 3 && value.every(Number.isFinite);
    this.storeys = toList(storeys).map((storey) => toText(storey?.name));
    for (const space of toList(spaces)) {
      const [min, max] = [space?.min, space?.max];
      if (!isPoint(min) || !isPoint(max)) continue;
      const floor = { x: (min[0]! + max[0]!) / 2, y: min[1]!, z: (min[2]! + max[2]!) / 2 };
      this.rooms.push({ floor, area: (max[0]! - min[0]!) * (max[2]! - min[2]!) });
    }
  }

  /** Asks the server for the objects that the scene file did not describe. */
  async complete(connection: WorldSource, objects: number): Promise<void> {
    const missing: number[] = [];
    for (let id = 1; id <= objects; ++id) if (!this.byId.has(id)) missing.push(id);
    for (let from = 0; from < missing.length; from += IDS_PER_REQUEST) {
      const ids = missing.slice(from, from + IDS_PER_REQUEST);
      const { entities } = await connection.request("describe", { ids });
      for (const { id, kind, name, globalId } of entities) {
        if (kind === Entity_Kind.OBJECT) this.add({ id, path: name, globalId, class: "", storey: "", coplanarRank: 0 });
      }
    }
  }
}

function toText(value: unknown): string {
  return typeof value === "string" ? value : "";
}
