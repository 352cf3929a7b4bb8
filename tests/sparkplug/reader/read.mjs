// read.mjs: payloads of Sparkplug B by sparkplug-payload, a public library. Each line of standard input is "decode HEX" or
// "encode JSON"; each line of standard output is the payload as JSON, or its bytes in hexadecimal.
import { createInterface } from "node:readline";
import { createRequire } from "node:module";

const sparkplug = createRequire(import.meta.url)("sparkplug-payload").get("spBv1.0");
const plain = (_, value) =>
  value !== null && typeof value === "object" && "low" in value && "high" in value && "unsigned" in value
    ? BigInt.asIntN(64, (BigInt(value.high) << 32n) + BigInt(value.low >>> 0)).toString()
    : value;

for await (const line of createInterface({ input: process.stdin })) {
  const blank = line.indexOf(" ");
  const text = line.slice(blank + 1);
  if (line.slice(0, blank) === "decode") {
    console.log(JSON.stringify(sparkplug.decodePayload(Buffer.from(text, "hex")), plain));
  } else {
    console.log(Buffer.from(sparkplug.encodePayload(JSON.parse(text))).toString("hex"));
  }
}
