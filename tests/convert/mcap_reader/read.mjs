// read.mjs FILE: an MCAP file as JSON, read twice by MCAP's own TypeScript library: by its index, and front to back with
// every CRC checked. Fails where the two do not agree, or the file is not as the specification says.
import { open, readFile } from "node:fs/promises";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";

const path = process.argv[2];

class Readable {
  constructor(handle) {
    this.handle = handle;
  }
  async size() {
    return BigInt((await this.handle.stat()).size);
  }
  async read(offset, length) {
    const buffer = new Uint8Array(Number(length));
    await this.handle.read(buffer, 0, Number(length), Number(offset));
    return buffer;
  }
}

const handle = await open(path);
const indexed = await McapIndexedReader.Initialize({ readable: new Readable(handle) });
const byIndex = [];
for await (const message of indexed.readMessages()) byIndex.push(message);
const attachments = [];
for await (const attachment of indexed.readAttachments()) attachments.push(attachment);

const stream = new McapStreamReader({ validateCrcs: true });
stream.append(await readFile(path));
const inOrder = [];
const kinds = {};
for (let record; (record = stream.nextRecord()); ) {
  kinds[record.type] = (kinds[record.type] ?? 0) + 1;
  if (record.type === "Message") inOrder.push(record);
}
if (!stream.done()) throw new Error("the file ends early");
if (inOrder.length !== byIndex.length) throw new Error(`${inOrder.length} messages, ${byIndex.length} by the index`);

const text = (bytes) => Buffer.from(bytes).toString("utf8");
const plain = (_, value) => (typeof value === "bigint" ? value.toString() : value);
const channels = Object.fromEntries([...indexed.channelsById].map(([id, channel]) => [id, channel]));
console.log(
  JSON.stringify(
    {
      kinds,
      header: indexed.header,
      schemas: [...indexed.schemasById.values()].map((s) => ({ ...s, data: text(s.data) })),
      channels: Object.values(channels).map((c) => ({ ...c, metadata: Object.fromEntries(c.metadata) })),
      statistics: {
        ...indexed.statistics,
        channelMessageCounts: Object.fromEntries(indexed.statistics.channelMessageCounts),
      },
      chunks: indexed.chunkIndexes.length,
      attachments: attachments.map((a) => ({ ...a, data: text(a.data) })),
      messages: inOrder.map((m) => ({
        topic: channels[m.channelId].topic,
        encoding: channels[m.channelId].messageEncoding,
        schemaId: channels[m.channelId].schemaId,
        sequence: m.sequence,
        logTime: m.logTime,
        publishTime: m.publishTime,
        hex: Buffer.from(m.data).toString("hex"),
      })),
      byIndex: byIndex.length,
    },
    plain,
  ),
);
