// Reads FILE with the reader of MCAP's own authors: by its index, or with --stream from front to back
// up to where the file was cut off. Prints, as one JSON object, the messages of each channel.
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { decompress } from "fzstd";
import { readFileSync } from "node:fs";

const stream = process.argv[2] === "--stream";
const bytes = readFileSync(process.argv.at(-1));
const decompressHandlers = { zstd: (packed, size) => decompress(packed, new Uint8Array(Number(size))) };
const channels = {};
const count = (channel, message) => {
  const told = (channels[channel.topic] ??= { messages: 0, bytes: 0 });
  told.messages += 1;
  told.bytes += message.data.byteLength;
};

if (stream) {
  const reader = new McapStreamReader({ validateCrcs: true, decompressHandlers });
  reader.append(bytes);
  const known = new Map();
  for (let record; (record = reader.nextRecord()); ) {
    if (record.type === "Channel") known.set(record.id, record);
    if (record.type === "Message") count(known.get(record.channelId), record);
  }
} else {
  const readable = {
    size: async () => BigInt(bytes.length),
    read: async (offset, size) => bytes.subarray(Number(offset), Number(offset + size)),
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  for await (const message of reader.readMessages()) {
    count(reader.channelsById.get(message.channelId), message);
  }
}
process.stdout.write(JSON.stringify(channels) + "\n");
