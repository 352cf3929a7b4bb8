// Whatever comes as COMMAND_STATUS: sessions neither crash nor send a command under a second id, and end once.
#include <algorithm>
#include <axlecast/command_body_t.hpp>
#include <axlecast/command_t.hpp>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "client/command/command_session.h"
#include "core/command/commands.h"
#include "core/messages/message.h"
#include "tests/support/fake_clock.h"
#include "tests/support/memory_sink.h"

namespace {

using axlecast::CommandId;

constexpr CommandId kId = {1, 2, 3};
constexpr CommandId kProbe = {4};

// The fuzzer cannot guess a digest: the status gets the one of the newest body.
std::vector<std::uint8_t> Fitted(axlecast::command_status_t status, std::int64_t digest, bool fits) {
  if (fits) std::copy(kId.begin(), kId.end(), std::begin(status.id));
  if (fits && status.state != axlecast::command_status_t::STATE_UNKNOWN) status.body_digest = digest;
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(status.getEncodedSize()));
  status.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

void Require(bool holds) {
  if (!holds) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  axlecast::FakeClock clock;
  axlecast::MemorySink sink;
  axlecast::CommandSessions sessions(clock, sink, axlecast::Origin{.boot_id = 1}, {});
  sessions.Send(kId, {.device = "axis1", .operation = "zero"});
  sessions.Query(kId, kProbe);
  std::int64_t digest = 0;
  bool ended = false;
  int ends = 0;
  while (size >= 4) {
    const std::size_t length = std::min<std::size_t>(size - 4, static_cast<std::size_t>(data[0]) + data[1] * 256U);
    const axlecast::Bytes message(data + 4, length);
    sessions.OnStatus(message, nullptr);
    if (const auto status = axlecast::DecodeMessage<axlecast::command_status_t>(message)) {
      sessions.OnStatus(Fitted(*status, digest, (data[2] & 1) != 0), nullptr);
    } else if (length > 0) {
      axlecast::command_status_t made{};
      made.state = static_cast<std::int8_t>(message[0] % 12);
      made.is_final = made.state >= axlecast::command_status_t::STATE_SUCCEEDED ? 1 : 0;
      made.boot_id = data[2] % 3;
      made.reason_code = data[2] % 40;
      sessions.OnStatus(Fitted(made, digest, true), nullptr);
    }
    clock.Advance(data[3] * axlecast::kMillisecond * 10);
    sink.Clear();
    static_cast<void>(sessions.Poll([&](const axlecast::CommandResult& result) {
      Require(result.id == kId && !result.under_way);
      ++ends;
    }));
    for (const auto& sent : sink.All<axlecast::command_t>("COMMAND")) {
      const auto body = axlecast::DecodeMessage<axlecast::command_body_t>(sent.body);
      Require(body && std::equal(kId.begin(), kId.end(), std::begin(body->id)));
      if (body->mode != axlecast::command_body_t::MODE_EXECUTE) continue;
      const std::int64_t now = axlecast::BodyDigest(sent.body);
      Require(!ended && (digest == 0 || digest == now));
      digest = now;
    }
    const bool done = sessions.Find({axlecast::CommandSessions::Kind::kCommand, kId})->done();
    Require(done || !ended);
    ended = done;
    Require(ends == (done ? 1 : 0));
    data += 4 + length;
    size -= 4 + length;
  }
  return 0;
}
