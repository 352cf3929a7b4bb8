#include "tools/axlecast/command_client.h"

#include <sodium.h>

#include <axlecast/command_t.hpp>
#include <optional>

#include "drivers/io/process.h"
#include "drivers/runtime/core/decode_message.h"

namespace axlecast {
namespace {

constexpr std::size_t kMaxBody = 1'200;
constexpr int kWaitMs = 5;

CommandId RandomId() {
  CommandId id;
  randombytes_buf(id.data(), id.size());
  return id;
}

}  // namespace

CommandClient::CommandClient(LcmPort& port, const Clock& clock)
    : port_(port), clock_(clock), boot_id_(RandomBootId()), receiver_(std::make_shared<Receiver>()) {
  (void)port_.Subscribe("COMMAND_STATUS", [receiver = receiver_](const std::string&, Bytes message) {
    if (*receiver) (*receiver)(message);
  });
}

CommandClient::~CommandClient() { *receiver_ = nullptr; }

CommandResult CommandClient::Execute(const CommandRequest& request, const Options& options) {
  std::size_t size = request.device.size() + request.operation.size() + request.reason.size();
  for (const auto& [key, value] : request.arguments) size += key.size() + value.size() + 10;
  constexpr std::size_t kRest = 100;  // fixed fields and lengths of command_body_t
  if (request.arguments.size() > 16 || size + kRest > kMaxBody) {
    CommandResult result;
    result.problem = "its arguments do not fit a command (16 arguments, 1,100 bytes): nothing was sent";
    return result;
  }
  const MonoNs now = clock_.Now();
  return Follow(CommandSession(RandomId(), request, now, now + options.wait_ms * kMillisecond), options);
}

CommandResult CommandClient::Query(const CommandId& id, const Options& options) {
  const MonoNs now = clock_.Now();
  return Follow(CommandSession::Query(id, now, now + options.wait_ms * kMillisecond), options);
}

CommandResult CommandClient::Follow(CommandSession session, const Options& options) {
  if (!port_.problem().empty()) {
    CommandResult result = session.result();
    result.problem = port_.problem();
    return result;
  }
  *receiver_ = [&](Bytes message) {
    const auto status = DecodeMessage<command_status_t>(message);
    if (status && session.OnStatus(*status, clock_.Now()) && options.on_status) options.on_status(*status);
  };
  while (true) {
    const MonoNs now = clock_.Now();
    if (options.cancel != nullptr && *options.cancel) session.Cancel(now);
    if (const auto body = session.Next(now)) Send(*body, now);
    if (session.done()) break;
    if (port_.Handle(kWaitMs)) continue;
    CommandResult result = session.result();
    result.problem = "the command port failed: ask for this id later, and look at the device";
    *receiver_ = nullptr;
    return result;
  }
  *receiver_ = nullptr;
  return session.result();
}

void CommandClient::Send(const std::vector<std::uint8_t>& body, MonoNs now) {
  command_t envelope{};
  envelope.utime = clock_.UtcMicroseconds();
  envelope.mono_ns = now;
  envelope.boot_id = boot_id_;
  envelope.seq = seq_++;
  envelope.body = body;
  envelope.body_size = static_cast<std::int16_t>(body.size());
  Publish(port_, "COMMAND", envelope);
}

}  // namespace axlecast
