// Writes src/generated/enfilade_pb.ts: the messages of enfilade.proto with their TypeScript types. The input is the
// descriptor file of the Python client, so that the build needs no protoc.
import { create, fromBinary, toBinary } from "@bufbuild/protobuf";
import {
  CodeGeneratorRequestSchema, CodeGeneratorResponseSchema, FileDescriptorSetSchema,
} from "@bufbuild/protobuf/wkt";
import { spawnSync } from "node:child_process";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { basename } from "node:path";
import { fileURLToPath } from "node:url";

const toPath = (relative) => fileURLToPath(new URL(relative, import.meta.url));
const descriptors = fromBinary(
  FileDescriptorSetSchema,
  readFileSync(toPath("../../../protocol/clients/python/enfilade/messages.desc")),
);
const source = descriptors.file.find((file) => basename(file.name) === "enfilade.proto");
if (!source) throw new Error("messages.desc does not contain enfilade.proto");
source.name = "enfilade.proto";

const request = toBinary(CodeGeneratorRequestSchema, create(CodeGeneratorRequestSchema, {
  fileToGenerate: [source.name], parameter: "target=ts", protoFile: descriptors.file,
}));
const generator = spawnSync(process.execPath, [toPath("../node_modules/@bufbuild/protoc-gen-es/bin/protoc-gen-es")], {
  input: request, maxBuffer: 1 << 26,
});
if (generator.status !== 0) throw new Error(`protoc-gen-es failed: ${generator.stderr}`);
const response = fromBinary(CodeGeneratorResponseSchema, generator.stdout);
if (response.error) throw new Error(response.error);

mkdirSync(toPath("../src/generated"), { recursive: true });
for (const file of response.file) {
  writeFileSync(toPath(`../src/generated/${basename(file.name)}`), file.content);
}
