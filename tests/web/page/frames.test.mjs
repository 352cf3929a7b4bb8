import assert from "node:assert/strict";
import test from "node:test";
import { BadFrame, decode, encode } from "../../../tools/web/page/frames.js";

test("a frame of the protocol is given on, with fields that nobody knows", () => {
  const frame = decode('{"type":"playback","utime":5,"playing":true,"speed":2.0,"later":1}');
  assert.equal(frame.speed, 2);
  assert.equal(decode('{"type":"reset"}').type, "reset");
});

test("a type that is not known is passed over", () => {
  assert.equal(decode('{"type":"weather"}'), null);
  assert.equal(decode('{"type":"constructor"}'), null);
});

test("what is not as the protocol says is named", () => {
  const bad = [
    "",
    "{",
    "null",
    "[]",
    "7",
    "{}",
    '{"type":7}',
    '{"type":"state","utime":"now","devices":[],"buses":[],"recorders":[]}',
    '{"type":"alarms","device":"a","utime":1,"total":0,"entries":null,"appeared":[],"cleared":[]}',
    '{"type":"samples","device":"a","dropped":0,"t0_utime":0,"dt_us":{},"columns":{}}',
  ];
  for (const text of bad) assert.throws(() => decode(text), BadFrame, text);
  assert.throws(() => decode('{"type":"error"}'), /error\.text is undefined, not string/);
});

test("what the page asks for is as the protocol says", () => {
  assert.deepEqual(JSON.parse(encode.subscribe(["a"], 60)), { type: "subscribe", devices: ["a"], history_s: 60 });
  assert.deepEqual(JSON.parse(encode.seek(1000.4)), { type: "seek", utime: 1000 });
  assert.deepEqual(JSON.parse(encode.speed(0.5)), { type: "speed", factor: 0.5 });
  assert.deepEqual(
    [encode.play(), encode.pause()].map((text) => JSON.parse(text).type),
    ["play", "pause"],
  );
});
