// read.mjs URL [--protocol NAME] [--stalled] [--until TOPIC=COUNT,...] [--seconds N]: Foxglove's own client, unchanged. It subscribes to every
// channel, decodes every message by the schema that the server sent, and prints what came as one JSON object when each TOPIC has COUNT
// messages, or after N seconds. --stalled: it reads nothing more after it has subscribed.
import rosmsg from "@foxglove/rosmsg";
import serialization from "@foxglove/rosmsg2-serialization";
import protocols from "@foxglove/ws-protocol";
import { WebSocket } from "ws";

const { parse } = rosmsg;
const { MessageReader, MessageWriter } = serialization;
const { FoxgloveClient } = protocols;

const words = process.argv.slice(2);
const option = (name) => (words.includes(name) ? words[words.indexOf(name) + 1] : undefined);
const until = (option("--until") ?? "").split(",").filter(Boolean).map((each) => each.split("="));
const protocol = option("--protocol") ?? FoxgloveClient.SUPPORTED_SUBPROTOCOL;
const socket = new WebSocket(words[0], [protocol]);
const client = new FoxgloveClient({ ws: socket });
const plain = (_, value) => (typeof value === "bigint" ? value.toString() : ArrayBuffer.isView(value) ? Array.from(value, (each) => (typeof each === "bigint" ? each.toString() : each)) : value);

const topics = {}; // of each: what came
const byTopic = new Map();
const bySubscription = new Map();
const seen = { serverInfo: undefined, status: [], unadvertised: [], topics };

let ended = false;
function end(code) {
  if (ended) return;
  ended = true;
  // A pipe takes 64 kB at once: the process must not end before the rest is written.
  process.stdout.write(`${JSON.stringify({ ...seen, protocol: socket.protocol }, plain)}\n`, () => process.exit(code));
}

client.on("serverInfo", (info) => (seen.serverInfo = info));
client.on("status", (status) => seen.status.push(status));
client.on("unadvertise", (ids) => seen.unadvertised.push(...ids));
client.on("error", (error) => {
  console.error(String(error?.message ?? error));
  process.exit(1);
});
client.on("close", (event) => {
  seen.closed = { code: event.code, reason: event.reason };
  end(2);
});
client.on("advertise", (channels) => {
  for (const channel of channels) {
    const definitions = parse(channel.schema, { ros2: true });
    const topic = (topics[channel.topic] = { channel: { ...channel }, messages: 0, gaps: 0, bytes: 0, rewritten: true, first: undefined, last: undefined });
    const entry = { topic, reader: new MessageReader(definitions), writer: new MessageWriter(definitions) };
    byTopic.set(channel.topic, entry);
    bySubscription.set(client.subscribe(channel.id), entry);
  }
  if (words.includes("--stalled")) socket.pause();
});
client.on("message", ({ subscriptionId, timestamp, data }) => {
  const { topic, reader, writer } = bySubscription.get(subscriptionId);
  const message = reader.readMessage(data);
  if (topic.messages < 20) {
    const again = writer.writeMessage(message);
    topic.rewritten &&= Buffer.compare(Buffer.from(data.buffer, data.byteOffset, data.byteLength), Buffer.from(again)) === 0;
  }
  if (topic.last !== undefined && message.seq !== undefined) topic.gaps += Number(message.seq - topic.last.message.seq) - 1;
  topic.messages += 1;
  topic.bytes += data.byteLength;
  topic.last = { timestamp, message };
  topic.first ??= topic.last;
  if (until.length > 0 && until.every(([name, count]) => (topics[name]?.messages ?? 0) >= Number(count))) end(0);
});
if (option("--seconds")) setTimeout(() => end(0), 1000 * Number(option("--seconds")));
