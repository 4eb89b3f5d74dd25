// The table of entities: objects of the scene by id, with path, class, GlobalId and storey.
import { Entity_Kind } from "./generated/enfilade_pb";
import type { WorldSource } from "./source";

export interface Entity {
  id: number;
  path: string;
  globalId: string;
  class: string;
  storey: string;
}

const IDS_PER_REQUEST = 20_000; // replies then stay far below 8 MiB

export class EntityTable {
  readonly byId = new Map<number, Entity>();
  readonly byPath = new Map<string, Entity>();
  readonly avatars = new Map<number, string>(); // names, by entity id; a name stays after its avatar left
  /** Every object of a moving body, and the id of that body. */
  readonly bodyOf = new Map<number, number>();

  add(entity: Entity): void {
    this.byId.set(entity.id, entity);
    this.byPath.set(entity.path, entity);
  }

  /** The name that a person reads: the path of an object, or the name of an avatar. */
  nameOf(id: number): string {
    return this.byId.get(id)?.path ?? this.avatars.get(id) ?? `entity ${id}`;
  }

  /** Takes a record of a scene file. Unknown or wrong fields are left out. */
  addRecord(record: unknown): Entity | null {
    if (typeof record !== "object" || record === null) return null;
    const fields = record as Record<string, unknown>;
    const text = (name: string) => (typeof fields[name] === "string" ? (fields[name] as string) : "");
    const id = Number(fields.entity ?? fields.id);
    if (!Number.isInteger(id) || id <= 0) return null;
    const path = text("path") || text("name") || `object ${id}`;
    const entity = { id, path, globalId: text("globalId"), class: text("class"), storey: text("storey") };
    this.add(entity);
    return entity;
  }

  /** Asks the server for the objects that the scene file did not describe. */
  async complete(connection: WorldSource, objects: number): Promise<void> {
    const missing: number[] = [];
    for (let id = 1; id <= objects; ++id) if (!this.byId.has(id)) missing.push(id);
    for (let from = 0; from < missing.length; from += IDS_PER_REQUEST) {
      const ids = missing.slice(from, from + IDS_PER_REQUEST);
      const { entities } = await connection.request("describe", { ids });
      for (const { id, kind, name, globalId } of entities) {
        if (kind === Entity_Kind.OBJECT) this.add({ id, path: name, globalId, class: "", storey: "" });
      }
    }
  }
}
