// Tests of the GLB that viewers get, by the Khronos validator and by glTF Transform.
//   node scene_glb_test.mjs --server build/enfilade [--scenes ../shared/scenes]
// Without the shared scenes only our own are tested; under CI that is a failure.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { basename, join } from "node:path";
import { parseArgs } from "node:util";
import { NodeIO } from "@gltf-transform/core";
import { EXTMeshGPUInstancing } from "@gltf-transform/extensions";
import validator from "gltf-validator";
import { listScenes, runTests } from "./harness.mjs";

const { values: options } = parseArgs({
  options: { server: { type: "string" }, scenes: { type: "string", default: "../shared/scenes" } },
});
assert.ok(options.server, "--server names the program");
const SHARED = [
  "aws-small-house/small_house.gltf", "cpr-office/office.dae", "cpr-office/cpr_office_ascii.fbx", "duplex/Duplex_A_20110907.ifc",
  "duplex/Duplex_Electrical_20121207.ifc", "duplex/duplex_utm32.glb", "fzk-haus/AC14-FZK-Haus.ifc", "pandora/pandora.obj",
  "schependomlaan/LINDEN_-_Kozijnen.ifc", "schependomlaan/schependomlaan_block.glb", "schependomlaan/schependomlaan_estate.glb",
  "single-rooms/spheres-room.glb", "single-rooms/vr-gallery.glb", "willow-garage/meshes/willowgarage_visual.dae",
];
const scenes = listScenes(["build/assets/building.glb", "build/assets/feeder.glb"], options.scenes, SHARED);

const scratch = mkdtempSync(join(tmpdir(), "enfilade-glb-"));
const reader = new NodeIO().registerExtensions([EXTMeshGPUInstancing]);
const run = (...args) => JSON.parse(execFileSync(options.server, args, { stdio: ["ignore", "pipe", "ignore"], maxBuffer: 1 << 28 }).toString());

/** The triangles that a viewer draws, and the ids of the entities that they belong to. */
function count(document) {
  const ids = new Set();
  let triangles = 0;
  for (const node of document.getRoot().listNodes()) {
    const { entities, entity } = node.getExtras();
    for (const id of entities ?? (entity === undefined ? [] : [entity])) ids.add(id);
    const instances = node.getExtension("EXT_mesh_gpu_instancing")?.getAttribute("_ENTITY_ID").getCount() ?? 1;
    for (const primitive of node.getMesh()?.listPrimitives() ?? []) triangles += (instances * primitive.getIndices().getCount()) / 3;
  }
  return { ids, triangles };
}

const BOX = 12; // triangles

/** Paths of triggers, which are not drawn. All triggers of these scenes are boxes. */
function findTriggers(inspected) {
  return new Set(inspected.bodies.filter(({ kind }) => kind === "trigger").flatMap(({ objects }) => objects));
}

async function test(scene) {
  const file = join(scratch, `${basename(scene)}.glb`);
  const written = run("export", scene, "--glb", file);
  const bytes = readFileSync(file);
  const { issues } = await validator.validateBytes(new Uint8Array(bytes), { maxIssues: 20 });
  assert.deepEqual(issues.messages.filter(({ severity }) => severity === 0), [], "errors of the validator");
  const { ids, triangles } = count(await reader.readBinary(new Uint8Array(bytes)));
  const inspected = run("inspect", scene, "--objects", "--json");
  const triggers = findTriggers(inspected);
  assert.equal(triangles, inspected.triangles - BOX * triggers.size, "triangles");
  assert.equal(written.triangles, triangles);
  const wanted = inspected.object_list.filter(({ path }) => !triggers.has(path)).map(({ id }) => id);
  assert.deepEqual([...ids].sort((a, b) => a - b), wanted, "entities");
  console.log(`        ${basename(scene)}: ${ids.size} objects, ${triangles} triangles, ${issues.numWarnings} warnings`);
}

const failures = await runTests(Object.fromEntries(scenes.map((scene) => [scene, () => test(scene)])));
rmSync(scratch, { recursive: true });
process.exit(failures === 0 ? 0 : 1);
