// Reads FILE with the reader of MCAP's own authors, by its index. With --stream, from front to back
// up to where the file was cut off. Prints, as one JSON object, the messages of each channel; with
// --messages each one, its bytes and the channels' schemas in base64.
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { decompress } from "fzstd";
import { readFileSync } from "node:fs";

const stream = process.argv.includes("--stream"), whole = process.argv.includes("--messages");
const bytes = readFileSync(process.argv.at(-1));
const decompressHandlers = { zstd: (packed, size) => decompress(packed, new Uint8Array(Number(size))) };
const channels = {}, messages = [];
const base64 = (data) => Buffer.from(data).toString("base64");
const count = (channel, schema, message) => {
  const summary = (channels[channel.topic] ??= { messages: 0, bytes: 0, type: schema.name });
  summary.messages += 1;
  summary.bytes += message.data.byteLength;
  if (!whole) return;
  summary.schema ??= base64(schema.data);
  messages.push([channel.topic, Number(message.logTime) / 1e9, base64(message.data)]);
};

if (stream) {
  const reader = new McapStreamReader({ validateCrcs: true, decompressHandlers });
  reader.append(bytes);
  const known = new Map(), schemas = new Map();
  for (let record; (record = reader.nextRecord()); ) {
    if (record.type === "Schema") schemas.set(record.id, record);
    if (record.type === "Channel") known.set(record.id, record);
    if (record.type !== "Message") continue;
    const channel = known.get(record.channelId);
    count(channel, schemas.get(channel.schemaId), record);
  }
} else {
  const readable = {
    size: async () => BigInt(bytes.length),
    read: async (offset, size) => bytes.subarray(Number(offset), Number(offset + size)),
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  for await (const message of reader.readMessages()) {
    const channel = reader.channelsById.get(message.channelId);
    count(channel, reader.schemasById.get(channel.schemaId), message);
  }
}
process.stdout.write(JSON.stringify(whole ? { channels, messages } : channels) + "\n");
