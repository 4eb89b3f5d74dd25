// The shared glTF scenes in the encodings of today's exporters, written by glTF Transform. Each imports to the same
// objects and triangles, and places within the step of its quantization.
//   node encoded_scenes_test.mjs --server build/enfilade [--scenes ../shared/scenes]
// Without the shared scenes our own building alone is tested; under CI that is a failure.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { copyFileSync, existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { basename, join } from "node:path";
import { parseArgs } from "node:util";
import { Logger, NodeIO } from "@gltf-transform/core";
import { ALL_EXTENSIONS } from "@gltf-transform/extensions";
import { draco, instance, meshopt, quantize, sparse } from "@gltf-transform/functions";
import draco3d from "draco3dgltf";
import { MeshoptDecoder, MeshoptEncoder } from "meshoptimizer";
import { listScenes, runTests } from "./harness.mjs";

const { values: options } = parseArgs({
  options: { server: { type: "string" }, scenes: { type: "string", default: "../shared/scenes" } },
});
assert.ok(options.server, "--server names the program");
const SHARED = [
  "aws-small-house/small_house.gltf", "duplex/duplex_utm32.glb", "schependomlaan/schependomlaan_block.glb",
  "schependomlaan/schependomlaan_estate.glb", "single-rooms/spheres-room.glb", "single-rooms/vr-gallery.glb",
];
const scenes = listScenes(["build/assets/building.glb"], options.scenes, SHARED);

const BITS = 16; // of a quantized position
const PIXEL = Buffer.from("iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mP8z8BQDwAEhQGAhKmMIQAAAABJRU5ErkJggg==", "base64");
const ENCODINGS = {
  quantized: quantize({ quantizePosition: BITS }),
  draco: draco({ method: "sequential", quantizePosition: BITS }),
  meshopt: meshopt({ encoder: MeshoptEncoder, level: "medium", quantizePosition: BITS }),
  meshoptVersion1: meshopt({ encoder: MeshoptEncoder, level: "medium", quantizePosition: BITS }),
  sparse: sparse({ ratio: 1 }),
  instanced: instance({ min: 2 }),
};

await MeshoptEncoder.ready;
const dependencies = {
  "draco3d.encoder": await draco3d.createEncoderModule(),
  "meshopt.encoder": MeshoptEncoder,
  "meshopt.decoder": MeshoptDecoder,
};
/** Reads scenes whose pictures may be missing, as exports often are; only geometry is compared here. */
class GeometryIO extends NodeIO {
  async readURI(uri, type) {
    const isMissingPicture = /\.(png|jpe?g)$/i.test(uri) && !existsSync(uri);
    return isMissingPicture ? PIXEL : super.readURI(uri, type);
  }
}
const io = new GeometryIO().registerExtensions(ALL_EXTENSIONS).registerDependencies(dependencies);

/** Writes streams of version 1 of the vertex codec, with the name of the extension that has it. */
async function writeVersion1(file, document) {
  let streams = 0;
  const encodeGltfBuffer = (source, count, size, mode) => {
    const stream = MeshoptEncoder.encodeGltfBuffer(source, count, size, mode, 1);
    if (stream[0] === 0xa1) ++streams;
    return stream;
  };
  const encoder = { ...MeshoptEncoder, encodeGltfBuffer };
  const writer = new NodeIO().registerExtensions(ALL_EXTENSIONS).registerDependencies({ ...dependencies, "meshopt.encoder": encoder });
  await writer.write(file, document);
  assert.ok(streams > 0, "streams of version 1");
  const bytes = readFileSync(file, "latin1");
  writeFileSync(file, bytes.replaceAll("EXT_meshopt_compression", "KHR_meshopt_compression"), "latin1"); // names of one length
}
const scratch = mkdtempSync(join(tmpdir(), "enfilade-encoded-"));

function inspect(file) {
  const arguments_ = ["inspect", file, "--objects", "--json", "--no-cache", "--offset", "0,0,0"];
  return JSON.parse(execFileSync(options.server, arguments_, { stdio: ["ignore", "pipe", "ignore"], maxBuffer: 1 << 28 }).toString());
}

const corners = ({ box }) => [...box.min, ...box.max];
const distance = (a, b) => Math.max(...corners(a).map((value, k) => Math.abs(value - corners(b)[k])));

/** How far the box of an object is from where it was, at most. Instances have names of their own: the nearest counts. */
function findFarthest(plain, encoded, byName) {
  return Math.max(...plain.object_list.map((object, k) =>
    byName ? distance(object, encoded.object_list[k]) : Math.min(...encoded.object_list.map((other) => distance(object, other)))));
}

/** Inspects the scene as it is, a GLB without its sidecar. */
function inspectPlain(scene) {
  if (!scene.endsWith(".glb")) return inspect(scene);
  const alone = join(scratch, basename(scene));
  copyFileSync(scene, alone);
  return inspect(alone);
}

async function test(scene, plain, name) {
  const file = join(scratch, `${basename(scene, ".glb")}-${name}.glb`);
  const document = await io.read(scene);
  document.setLogger(new Logger(Logger.Verbosity.SILENT));
  await document.transform(ENCODINGS[name]);
  await (name === "meshoptVersion1" ? writeVersion1(file, document) : io.write(file, document));
  const encoded = inspect(file);
  assert.equal(encoded.objects, plain.objects, "objects");
  assert.equal(encoded.triangles, plain.triangles, "triangles");
  const byName = name !== "instanced";
  const paths = ({ object_list }) => object_list.map(({ path }) => path);
  if (byName) assert.deepEqual(paths(encoded), paths(plain), "paths");
  const size = Math.max(...plain.bounds.size);
  const off = findFarthest(plain, encoded, byName);
  const { min, max } = plain.bounds;
  const floats = 2 ** -23 * Math.max(...[...min, ...max].map(Math.abs)); // places of instances are floats
  const step = byName && name !== "sparse" ? size / (2 ** BITS - 1) : Math.max(1e-6 * size, floats);
  assert.ok(off <= step, `an object is ${off} m off; the step is ${step} m`);
}

const tests = {};
for (const scene of scenes) {
  let plain;
  for (const name of Object.keys(ENCODINGS))
    tests[`${basename(scene)}, ${name}`] = () => test(scene, (plain ??= inspectPlain(scene)), name);
}
const failures = await runTests(tests);
rmSync(scratch, { recursive: true });
process.exit(failures === 0 ? 0 : 1);
