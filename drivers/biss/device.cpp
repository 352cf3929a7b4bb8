#include <algorithm>
#include <array>
#include <axlecast/alarm_entry_t.hpp>
#include <axlecast/command_status_t.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "core/device/operation.h"
#include "drivers/biss/codec.h"
#include "drivers/biss/family.h"
#include "drivers/biss/settings.h"
#include "drivers/kit/clocked_line.h"
#include "drivers/kit/command_runner.h"

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

// The two status bits of every frame (SAA manual 5.6), both active low. What is behind them is the maker's.
constexpr AlarmSpec kErrorAlarm = {
    0x100, alarm_entry_t::SOURCE_DEVICE, alarm_entry_t::SEVERITY_CRITICAL, "error",
    "The position is not valid: check supply, speed and mounting; replace the encoder"};
constexpr AlarmSpec kWarningAlarm = {0x101, alarm_entry_t::SOURCE_DEVICE, alarm_entry_t::SEVERITY_WARNING,
                                     "warning",
                                     "The encoder nears a limit (dirt, ageing, temperature): see its data sheet"};

constexpr std::string_view kReadPositionName = "read_position";

}  // namespace

std::vector<AlarmSpec> Alarms() { return {kErrorAlarm, kWarningAlarm}; }

std::span<const OperationSpec> Operations() {
  static const std::vector<OperationSpec> kSpecs = {
      {.name = kReadPositionName,
       .help = "Reads the position once, and shows the place of the answer in the transfer",
       .reads_only = true,
       .verification = "the reading itself"},
  };
  return kSpecs;
}

namespace {

// Returns why a transfer gave no position, as device_info_t counts it.
ErrorKind KindOf(FrameError error) {
  using K = ErrorKind;
  constexpr std::array kKinds = {K::kFraming, K::kFraming, K::kTimeout, K::kBusy,
                                 K::kShort,   K::kRange,   K::kChecksum};
  return kKinds.at(static_cast<std::size_t>(error));
}

// read_position: shows the next frame, or fails after five transfers without one.
class PositionReadout final : public CommandProcedure {
 public:
  // `settings` outlives it.
  explicit PositionReadout(const BissSettings& settings) : settings_(settings) {}

  [[nodiscard]] Outcome OnFrame(const Reply& reply) const {
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
  // A transfer brought no frame. Returns the outcome if it was the last attempt.
  std::optional<Outcome> OnFailure(ErrorKind error) {
    if (++attempts_ < kAttempts) return std::nullopt;
    return Final(CommandState::kFailed, Reason::REASON_NO_REPLY,
                 Text("%d transfers brought no frame; the last one: %s (README of biss, Errors)", kAttempts,
                      ErrorName(error)));
  }
  [[nodiscard]] Outcome OnLinkLost() const override {
    return Final(CommandState::kFailed, Reason::REASON_NO_REPLY, "the link was lost before the reading");
  }

 private:
  const BissSettings& settings_;
  int attempts_ = 0;
};

// One encoder on BiSS-C, point to point: one transfer in each slot. The pause between transfers, in which the encoder
// sees that a frame is over, is the bus's pacing.
//
// - A failed reading is not repeated: the next slot brings another.
// - Every frame is complete within its transfer, so that no late reply can be mistaken for an answer.
// - A frame whose start bit is at another place than in the frame before is refused until the next frame confirms the
//   place. One wrong sample can hide the start bit or look like one, and one in 64 shifted frames passes the check.
// - While no encoder answers, it is polled ten times a second.
class BissDevice final : public CommandDevice<PositionReadout> {
 public:
  BissDevice(const DeviceConfig& device, DeviceOutput& output)
      : CommandDevice(device.settings, Operations(), output),
        settings_(Own(device)),
        reader_(settings_.format),
        half_cycle_(settings_.spi.ClockTime(1) / 2),
        on_wire_(settings_.spi.ClockTime(static_cast<std::int64_t>(8 * settings_.transfer_bytes) - 1)),
        transfer_(ClockedExchange(settings_.transfer_bytes, kTimeout)) {}

  [[nodiscard]] Step Next(const BusSlot& slot) const override {
    if (!link_up_) return {.action = Idle{kNever}, .priority = Priority::kLive};
    // A live reading serves a command too.
    if (slot.poll_due && slot.now >= not_before_) return {.action = transfer_, .priority = Priority::kLive};
    if (runner_.Runnable(slot.now) != nullptr) return {.action = transfer_, .priority = Priority::kCommand};
    return {.action = Idle{slot.poll_due ? not_before_ : kNever}, .priority = Priority::kLive};
  }
  void OnStarted(const Step& step, MonoNs now) override {
    runner_.ExpireIfLate(now);
    if (std::holds_alternative<Exchange>(step.action)) runner_.OnStarted(true);
  }
  void On(const Event& event) override {
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
    runner_.ExpireIfLate(event.End());
  }

 private:
  [[nodiscard]] Result<std::unique_ptr<PositionReadout>> MakeProcedure(const DriverCommand& command,
                                                                       MonoNs) const override {
    if (command.operation != kReadPositionName) return UnknownOperation("biss", command.operation);
    return std::make_unique<PositionReadout>(settings_);
  }
  // A transfer without a frame is what read_position reports: an encoder that does not answer is no reason to refuse.
  [[nodiscard]] Result<> CheckState(const DriverCommand&, MonoNs) const override { return {}; }
  void OnTransfer(const Event& event) {
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
  [[nodiscard]] bool StartIsBelieved(std::size_t start) {
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
  void OnFrame(const Reply& reply, const Event& event) {
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
  void ReportAlarms(const Reply& reply, MonoNs now) {
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
  [[nodiscard]] Interval LatchInstant(const Event& event) const {
    const MonoNs first = event.sent.first + half_cycle_;
    return {first, std::max(first, event.sent.last - on_wire_)};
  }

  const BissSettings& settings_;
  const FrameReader reader_;
  const MonoNs half_cycle_;
  const MonoNs on_wire_;  // from the first rising edge of a transfer to its last, at least
  Exchange transfer_;

  std::optional<std::size_t> start_;    // of the last frame believed
  std::optional<std::size_t> doubted_;  // of one since then that was not
  std::optional<Reply> before_;         // the good frame before
  int unanswered_ = 0;                  // transfers in a row that nobody acknowledged
  MonoNs not_before_ = 0;               // of a live reading
  std::optional<bool> failed_;          // as last reported by the alarm
  std::optional<bool> warned_;
};

}  // namespace

std::unique_ptr<Device> MakeDevice(const BusConfig&, const DeviceConfig& device, DeviceOutput& output,
                                   SecretSource&) {
  return std::make_unique<BissDevice>(device, output);
}

}  // namespace axlecast::biss
