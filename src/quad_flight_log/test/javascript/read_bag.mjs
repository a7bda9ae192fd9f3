// Reads an MCAP bag with libraries that share no code with ours: prints {topic: [count, digest of all values]}.
import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { McapIndexedReader } from "@mcap/core";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import { decompress } from "fzstd";

const data = readFileSync(process.argv[2]);
const readable = {
  size: async () => BigInt(data.length),
  read: async (offset, size) => new Uint8Array(data.buffer, data.byteOffset + Number(offset), Number(size)),
};
const reader = await McapIndexedReader.Initialize({
  readable,
  decompressHandlers: { zstd: (packed, size) => decompress(packed, new Uint8Array(Number(size))) },
});

const number = Buffer.alloc(8);
function feed(hash, value) {
  if (typeof value === "string") {
    const text = Buffer.from(value, "utf8");
    feed(hash, text.length);
    hash.update(text);
  } else if (typeof value === "object" && (Array.isArray(value) || ArrayBuffer.isView(value))) {
    feed(hash, value.length);
    for (const item of value) feed(hash, item);
  } else if (typeof value === "object") {
    for (const key of Object.keys(value)) feed(hash, value[key]);
  } else {
    number.writeDoubleLE(Number(value));
    hash.update(number);
  }
}

const topics = {};
for await (const message of reader.readMessages()) {
  const channel = reader.channelsById.get(message.channelId);
  if (!(channel.topic in topics)) {
    const schema = reader.schemasById.get(channel.schemaId);
    const definition = parse(new TextDecoder().decode(schema.data), { ros2: true });
    topics[channel.topic] = { decoder: new MessageReader(definition), hash: createHash("sha256"), count: 0 };
  }
  const topic = topics[channel.topic];
  feed(topic.hash, topic.decoder.readMessage(message.data));
  topic.count += 1;
}
console.log(JSON.stringify(Object.fromEntries(Object.entries(topics).map(([k, t]) => [k, [t.count, t.hash.digest("hex")]]))));
