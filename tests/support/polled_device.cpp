#include "tests/support/polled_device.h"

#include <algorithm>
#include <memory>

namespace axlecast {
namespace {

constexpr std::size_t kReplyLength = 5;

std::uint8_t SumOf(Bytes bytes) {
  unsigned sum = 0;
  for (const std::uint8_t byte : bytes) sum += byte;
  return static_cast<std::uint8_t>(sum);
}

}  // namespace

Step PolledDevice::Ask(std::uint8_t kind, Priority priority) const {
  return {.action =
              axlecast::Exchange{
                  .request = {address_, kind}, .reply_length = &FixedLength<kReplyLength>, .timeout = kTimeout},
          .priority = priority};
}

Step PolledDevice::Next(const BusSlot& turn) const {
  if (wants_stop && stops_regardless && !turn.reserved) {
    Step stop = Ask(kStop, Priority::kStop);
    std::get<axlecast::Exchange>(stop.action).regardless = true;
    return stop;
  }
  if (wants_silence_) return {.action = WaitForIdleLine{kQuiet}};
  if (turn.now < idle_until) return {.action = Idle{idle_until}};
  const bool orders = !(turn.reserved && leaves_reserved_turns);
  if (wants_stop && orders) return Ask(kStop, Priority::kStop);
  if (order_ && orders) return Ask(kTouch, Priority::kCommand);
  if (turn.poll_due) return Ask(kRead, Priority::kLive);
  if (wants_slow) return Ask(kSlowRead, Priority::kSlow);
  return {.action = Idle{}};
}

void PolledDevice::OnStarted(const Step& step, MonoNs) {
  if (const auto* exchange = std::get_if<axlecast::Exchange>(&step.action)) {
    started.push_back(exchange->request.data()[1]);
    touched_ = touched_ || started.back() == kTouch;
  }
}

void PolledDevice::On(const Event& event) {
  told.push_back(event.kind);
  switch (event.kind) {
    case Event::Kind::kReply:
      OnReply(event);
      break;
    case Event::Kind::kTimeout:
      output_.OnError(event.bytes.empty() ? ErrorKind::kTimeout : ErrorKind::kShort, event.received);
      wants_silence_ = true;
      break;
    case Event::Kind::kUnexpectedBytes:
      output_.OnError(ErrorKind::kUnexpectedBytes, event.received);
      wants_silence_ = true;
      break;
    default:
      wants_silence_ = false;
  }
}

void PolledDevice::OnReply(const Event& event) {
  const Bytes bytes = event.bytes;
  if (bytes[4] != SumOf(bytes.first(4))) {
    output_.OnError(ErrorKind::kChecksum, event.received);
    wants_silence_ = true;
    return;
  }
  if (bytes[1] == kStop) wants_stop = false;
  if (bytes[1] == kTouch && order_) {
    output_.OnOutcome(*std::exchange(order_, std::nullopt),
                      {.state = CommandState::kSucceeded, .text = "touched", .verified = true, .changes = {}});
  }
  output_.OnSample({.at = {event.sent.first, event.received.last}, .counts = bytes[2] << 8 | bytes[3]});
}

void PolledDevice::Begin(const DriverCommand& order, MonoNs) {
  order_ = order.id;
  touched_ = false;
}

bool PolledDevice::Cancel(const CommandId& id, MonoNs) {
  if (order_ != id || touched_) return false;
  order_.reset();
  return true;
}

std::vector<std::uint8_t> PolledDevice::Reply(std::uint8_t address, std::uint8_t kind, std::uint16_t counts) {
  std::vector<std::uint8_t> reply = {address, kind, static_cast<std::uint8_t>(counts >> 8),
                                     static_cast<std::uint8_t>(counts)};
  reply.push_back(SumOf(reply));
  return reply;
}

ScriptedLink::Peer PolledDevices(std::vector<std::uint8_t> dead) {
  return [dead = std::move(dead), replies = std::make_shared<std::uint16_t>()](Bytes request) {
    std::vector<ScriptedLink::Burst> bursts;
    if (std::find(dead.begin(), dead.end(), request[0]) == dead.end()) {
      bursts.push_back(
          {.after = 100 * kMicrosecond, .bytes = PolledDevice::Reply(request[0], request[1], (*replies)++)});
    }
    return bursts;
  };
}

}  // namespace axlecast
