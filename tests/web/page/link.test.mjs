import assert from "node:assert/strict";
import test from "node:test";
import { Link, waitBefore } from "../../../tools/web/page/link.js";

// A world in which time goes on when the test says so.
function world() {
  const sockets = [];
  const timers = [];
  const heard = [];
  const made = { time: 0, sockets, timers, heard };
  made.link = new Link(
    {
      open: () => {
        sockets.push({
          sent: [],
          send(text) {
            this.sent.push(text);
          },
        });
        return sockets.at(-1);
      },
      after: (ms, act) => timers.push({ ms, act }),
      now: () => made.time,
    },
    { open: () => {}, frame: (frame) => heard.push(frame), change: () => {} },
  );
  return made;
}

test("it gives on what it hears, and sends only while it is open", () => {
  const { link, sockets, heard } = world();
  link.send("early");
  sockets[0].onopen();
  sockets[0].onmessage({ data: '{"type":"reset"}' });
  link.send("late");
  assert.deepEqual([heard.length, sockets[0].sent], [1, ["late"]]);
});

test("it comes back by itself, later and later, at once after it was heard", () => {
  const made = world();
  const waits = [];
  for (let i = 0; i < 6; i += 1) {
    made.sockets.at(-1).onclose({ code: 1006 });
    assert.equal(made.link.state, "lost");
    waits.push(made.timers.at(-1).ms);
    made.timers.at(-1).act();
  }
  assert.deepEqual(waits, [500, 1000, 2000, 4000, 5000, 5000]);
  made.sockets.at(-1).onopen();
  made.sockets.at(-1).onmessage({ data: '{"type":"reset"}' });
  made.sockets.at(-1).onclose({ code: 1001 });
  assert.equal(made.timers.at(-1).ms, waitBefore(0));
});

test("it does not try again where the server has refused it", () => {
  for (const code of [1002, 1003, 1007, 1008, 1009]) {
    const { link, sockets, timers } = world();
    sockets[0].onclose({ code });
    assert.deepEqual([link.state, timers.length], ["refused", 0], String(code));
    assert.match(link.text, /Load the page again/);
  }
});

test("silence on an open connection is seen", () => {
  const made = world();
  made.sockets[0].onopen();
  made.time = 1900;
  assert.equal(made.link.isSilent, false);
  made.time = 2100;
  assert.equal(made.link.isSilent, true);
  made.sockets[0].onmessage({ data: '{"type":"reset"}' });
  assert.equal(made.link.isSilent, false);
});

test("a frame that is not of the protocol is counted and said, and does no harm", () => {
  const { link, sockets, heard } = world();
  sockets[0].onopen();
  sockets[0].onmessage({ data: "nonsense" });
  sockets[0].onmessage({ data: '{"type":"reset"}' });
  assert.deepEqual([link.badFrames, heard.length, link.state], [1, 1, "open"]);
  assert.match(link.text, /no JSON/);
});
