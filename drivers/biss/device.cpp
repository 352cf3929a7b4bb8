#include "drivers/biss/device.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/device/operation.h"
#include "drivers/kit/clocked_line.h"

namespace axlecast::biss {
namespace {

using Reason = command_status_t;

// A transfer ends by itself; only one over a simulated line can stay away.
constexpr MonoNs kTimeout = 100 * kMillisecond;
// Transfers that read_position makes at most.
constexpr int kAttempts = 5;
// Transfers in a row that nobody acknowledged, after which nobody is there; then it is looked for less often.
constexpr int kGone = 4;
constexpr MonoNs kLookAgain = 100 * kMillisecond;

}  // namespace

std::span<const OperationSpec> Operations() {
  static const std::vector<OperationSpec> kSpecs = {
      {.name = kReadPositionName,
       .help = "Reads the position once, and shows the place of the answer in the transfer",
       .reads_only = true,
       .verification = "the reading itself"},
  };
  return kSpecs;
}

ErrorKind KindOf(FrameError error) {
  switch (error) {
    case FrameError::kNoAck:
      return ErrorKind::kTimeout;
    case FrameError::kNoStart:
      return ErrorKind::kBusy;
    case FrameError::kShort:
      return ErrorKind::kShort;
    case FrameError::kCds:
      return ErrorKind::kRange;
    case FrameError::kChecksum:
      return ErrorKind::kChecksum;
    default:
      return ErrorKind::kFraming;
  }
}

BissDevice::BissDevice(const DeviceConfig& device, DeviceOutput& output)
    : CommandDevice(device.settings, Operations(), output),
      settings_(Own(device)),
      reader_(settings_.format),
      half_cycle_(settings_.spi.ClockTime(1) / 2),
      on_wire_(settings_.spi.ClockTime(static_cast<std::int64_t>(8 * settings_.transfer_bytes) - 1)),
      transfer_(ClockedExchange(settings_.transfer_bytes, kTimeout)) {}

Step BissDevice::Next(const BusSlot& slot) const {
  if (!link_up_) return {.action = Idle{kNever}, .priority = Priority::kLive};
  // A live reading serves a command too.
  if (slot.poll_due && slot.now >= not_before_) return {.action = transfer_, .priority = Priority::kLive};
  if (runner_.Runnable(slot.now) != nullptr) return {.action = transfer_, .priority = Priority::kCommand};
  return {.action = Idle{slot.poll_due ? not_before_ : kNever}, .priority = Priority::kLive};
}

void BissDevice::OnStarted(const Step& step, MonoNs now) {
  runner_.ExpireIfLate(now);
  if (std::holds_alternative<Exchange>(step.action)) runner_.OnStarted(true);
}

void BissDevice::On(const Event& event) {
  switch (event.kind) {
    case Event::Kind::kReply:
    case Event::Kind::kTimeout:
      OnTransfer(event);
      break;
    case Event::Kind::kUnexpectedBytes:
    case Event::Kind::kUnsolicited:
      output_.OnError(ErrorKind::kUnexpectedBytes, event.received);
      break;
    case Event::Kind::kLinkUp:
      link_up_ = true;
      before_.reset();
      start_.reset();
      doubted_.reset();
      unanswered_ = 0;
      not_before_ = 0;
      break;
    case Event::Kind::kLinkDown:
      link_up_ = false;
      runner_.OnLinkLost();
      break;
    default:
      break;
  }
  runner_.ExpireIfLate(std::max(event.sent.last, event.received.last));
}

void BissDevice::OnTransfer(const Event& event) {
  const Reply reply = reader_.ReadTransfer(event.bytes, 8 * event.bytes.size(), settings_.search);
  unanswered_ = reply.error == FrameError::kNoAck ? std::min(unanswered_ + 1, kGone) : 0;
  not_before_ = unanswered_ >= kGone ? event.received.last + kLookAgain : 0;
  ErrorKind kind = event.bytes.empty() ? ErrorKind::kTimeout : KindOf(reply.error);
  if (reply.error == FrameError::kNone) {
    if (StartIsBelieved(reply.start)) return OnFrame(reply, event);
    kind = ErrorKind::kFraming;
  }
  output_.OnError(kind, {event.sent.first, event.received.last});
  if (runner_.busy()) runner_.Report(runner_.procedure().OnFailure(kind));
}

bool BissDevice::StartIsBelieved(std::size_t start) {
  const auto near = [&](const std::optional<std::size_t>& other) {
    return other && std::max(start, *other) - std::min(start, *other) <= settings_.start_jitter;
  };
  const bool believed = !start_ || near(start_) || near(doubted_);
  if (believed) {
    start_ = start;
    doubted_.reset();
  } else {
    doubted_ = start;
  }
  return believed;
}

void BissDevice::OnFrame(const Reply& reply, const Event& event) {
  ReportAlarms(reply, event.received.last);
  Sample sample;
  sample.at = LatchInstant(event);
  sample.counts = reply.counts;
  sample.has_turns = settings_.turns_range > 0;
  sample.turns = static_cast<std::int32_t>(reply.turns);
  sample.error = reply.failed;
  sample.warning = reply.warned;
  sample.device_status = (reply.failed ? 0 : 2) | (reply.warned ? 0 : 1);  // nError, nWarning as sent
  output_.OnSample(sample);
  if (runner_.busy()) runner_.Report(runner_.procedure().OnFrame(reply));
}

// A bit counts when two frames in a row agree on it: a damaged one can pass the check bits.
void BissDevice::ReportAlarms(const Reply& reply, MonoNs now) {
  const std::optional<Reply> before = std::exchange(before_, reply);
  if (!before) return;
  const auto report = [&](const AlarmSpec& alarm, bool is, bool was, std::optional<bool>& reported) {
    if (is != was || reported == is) return;
    reported = is;
    output_.OnAlarm(alarm, is ? AlarmState::kLive : AlarmState::kAbsent, now);
  };
  report(kErrorAlarm, reply.failed, before->failed, failed_);
  report(kWarningAlarm, reply.warned, before->warned, warned_);
}

// 5.6: the first rising edge latches. It is half a cycle after the clock's first edge.
Interval BissDevice::LatchInstant(const Event& event) const {
  const MonoNs first = event.sent.first + half_cycle_;
  return {first, std::max(first, event.sent.last - on_wire_)};
}

Outcome PositionReadout::OnFrame(const Reply& reply) const {
  const double degrees = Degrees(reply.counts, settings_.format.bits);
  std::string text = Text("single-turn %u (%.4f deg)", reply.counts, degrees);
  if (settings_.turns_range > 0) text += Text(", turns %u", reply.turns);
  if (reply.warned) text += "; the encoder warns";
  Outcome outcome = Verified(text);
  if (reply.failed) {
    outcome = Final(CommandState::kFailed, Reason::REASON_DEVICE_ALARM,
                    text + "; the encoder reports an error: this position is not valid");
  }
  outcome.changes.push_back({"single_turn", "", std::to_string(reply.counts)});
  if (settings_.turns_range > 0) outcome.changes.push_back({"turns", "", std::to_string(reply.turns)});
  outcome.changes.push_back({"ack_at", "", std::to_string(reply.ack)});
  outcome.changes.push_back({"start_at", "", std::to_string(reply.start)});
  return outcome;
}

std::optional<Outcome> PositionReadout::OnFailure(ErrorKind error) {
  if (++attempts_ < kAttempts) return std::nullopt;
  return Final(CommandState::kFailed, Reason::REASON_NO_REPLY,
               Text("%d transfers brought no frame; the last one: %s (README of biss, Errors)", kAttempts,
                    ErrorName(error)));
}

Outcome PositionReadout::OnLinkLost() const {
  return Final(CommandState::kFailed, Reason::REASON_NO_REPLY, "the link was lost before the reading");
}

Result<std::unique_ptr<PositionReadout>> BissDevice::MakeProcedure(const DriverCommand& command, MonoNs) const {
  if (command.operation != kReadPositionName) return UnknownOperation("biss", command.operation);
  return std::make_unique<PositionReadout>(settings_);
}

}  // namespace axlecast::biss
