#include "drivers/saa_can/device.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <utility>

#include "core/device/operation.h"
#include "drivers/saa_can/operations.h"

namespace axlecast::saa_can {
namespace {

using Reason = command_status_t;

// An own frame that no node has acknowledged for so long keeps the next one back no more.
constexpr MonoNs kStale = kSecond;
constexpr MonoNs kAfterFullQueue = 100 * kMillisecond;
// A silent encoder is started again, and a gone one asked again, so often.
constexpr MonoNs kStartAgain = kSecond;
constexpr MonoNs kAskGone = 250 * kMillisecond;
constexpr int kGone = 4;  // requests in vain

constexpr const char* kTooLate =
    "nothing was done: the encoder could not be reached before its time to begin was over";

Step Sending(const CanFrame& frame, Priority priority) { return {.action = Send{frame}, .priority = priority}; }

}  // namespace

SaaCanDevice::SaaCanDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output)
    : owned_(device.settings),
      settings_(Own(device)),
      bench_(OwnBus(bus).bench),
      output_(output),
      interpreter_(settings_, bus.late, output) {}

// ---- what it wants ----

MonoNs SaaCanDevice::FreeAt() const {
  return std::max(not_before_, interpreter_.unconfirmed() ? sent_at_ + kStale : 0);
}

Step SaaCanDevice::Next(const BusSlot& turn) const {
  if (!link_up_ || silenced_) return {.action = Idle{kNever}, .priority = Priority::kLive};
  if (turn.now < FreeAt()) return Hear(turn);
  if (const auto step = ForProcedure(turn)) return *step;
  if (procedure_ && procedure_->alone()) return Hear(turn);
  if (const auto frame = SetUp(turn.now)) return Sending(*frame, Priority::kLive);
  const bool ask = settings_.mode == Mode::kSingle && turn.poll_due && turn.now >= PollAt();
  return ask ? Sending(Poll(), Priority::kLive) : Hear(turn);
}

std::optional<Step> SaaCanDevice::ForProcedure(const BusSlot& turn) const {
  if (!procedure_ || Expired(turn.now)) return std::nullopt;
  if (turn.reserved && !procedure_->alone()) return std::nullopt;
  const Procedure::Want want = procedure_->Wants(turn.now);
  if (const auto* frame = std::get_if<CanFrame>(&want)) return Sending(*frame, Priority::kCommand);
  const bool asks = std::holds_alternative<Procedure::Position>(want) && settings_.mode == Mode::kSingle;
  if (!asks || interpreter_.awaiting()) return std::nullopt;
  return Sending(Poll(), turn.poll_due ? Priority::kLive : Priority::kCommand);
}

std::optional<CanFrame> SaaCanDevice::SetUp(MonoNs now) const {
  if (settings_.mode == Mode::kSingle) return std::nullopt;
  if (period_to_set_) return CommandFrame(Command::kPeriod, settings_.node, *settings_.set_per_second);
  const bool again = interpreter_.silent_in_a_row() > 0 && now >= sent_at_ + kStartAgain;
  if (settings_.start && (to_start_ || again)) return CommandFrame(Command::kStart, settings_.node);
  return std::nullopt;
}

MonoNs SaaCanDevice::PollAt() const {
  if (interpreter_.awaiting()) return kNever;
  return interpreter_.silent_in_a_row() < kGone ? interpreter_.next_request_at() : sent_at_ + kAskGone;
}

// One that was switched off and on may have to be started again: 01 NN brings a position too.
CanFrame SaaCanDevice::Poll() const {
  const int silent = interpreter_.silent_in_a_row();
  const bool start = settings_.start && (to_start_ || (silent > 0 && silent % 2 == 0));
  return CommandFrame(start ? Command::kStart : Command::kRead, settings_.node);
}

// Until something must be missed, or may be sent.
Step SaaCanDevice::Hear(const BusSlot& turn) const {
  MonoNs until = interpreter_.due();
  if (turn.now < FreeAt()) {
    until = std::min(until, FreeAt());
  } else if (!procedure_ || !procedure_->alone()) {
    if (settings_.mode == Mode::kSingle && turn.poll_due) until = std::min(until, PollAt());
    const bool again = settings_.mode == Mode::kCyclic && settings_.start && interpreter_.silent_in_a_row() > 0;
    if (again) until = std::min(until, sent_at_ + kStartAgain);
  }
  if (procedure_) until = std::min({until, procedure_->Due(turn.now), procedure_->touched() ? kNever : begin_by_});
  return {.action = Listen{std::max(until, turn.now)}, .priority = Priority::kLive};
}

void SaaCanDevice::OnStarted(const Step& step, MonoNs now) {
  if (Expired(now)) Report(Final(CommandState::kExpired, Reason::REASON_DEADLINE, kTooLate));
  const auto* send = std::get_if<Send>(&step.action);
  if (!procedure_ || send == nullptr || step.priority != Priority::kCommand) return;
  // A request for a position is no frame of the procedure's own.
  if (std::holds_alternative<CanFrame>(procedure_->Wants(now))) procedure_->OnStarted(send->frame);
}

// ---- what happened ----

void SaaCanDevice::On(const Event& event) {
  if (event.kind == Event::Kind::kLinkUp || event.kind == Event::Kind::kLinkDown) return OnLink(event);
  if (!link_up_) return;
  const MonoNs now = EndOf(event);
  NoteOwn(event, now);
  const Interpreter::Heard heard = interpreter_.Take(event);
  AdvanceProcedure(event, heard, now);
}

void SaaCanDevice::OnLink(const Event& event) {
  link_up_ = event.kind == Event::Kind::kLinkUp;
  if (link_up_) {
    silenced_ = false;
    period_to_set_ = settings_.set_per_second.has_value();
    to_start_ = settings_.start;
    not_before_ = 0;
    return interpreter_.OnLinkUp(EndOf(event));
  }
  interpreter_.OnLinkDown(EndOf(event));
  if (procedure_) Report(procedure_->OnLinkLost());
}

void SaaCanDevice::NoteOwn(const Event& event, MonoNs now) {
  if (event.id != RequestId(settings_.node)) return;
  if (event.kind == Event::Kind::kNotSent) not_before_ = now + kAfterFullQueue;
  if (event.kind != Event::Kind::kSent) return;
  sent_at_ = now;
  const std::optional<Request> request = ParseRequest(event.bytes);
  if (!request) return;
  if (request->command == Command::kStart) to_start_ = false;
  if (request->command == Command::kPeriod) period_to_set_ = false;
}

void SaaCanDevice::AdvanceProcedure(const Event& event, const Interpreter::Heard& heard, MonoNs now) {
  if (!procedure_) return;
  if (Expired(now)) return Report(Final(CommandState::kExpired, Reason::REASON_DEADLINE, kTooLate));
  Report(procedure_->On(event, heard, now));
}

// ---- orders ----

void SaaCanDevice::Begin(const DriverCommand& order, MonoNs now) {
  auto made = Admit(order, now);
  if (const Outcome* refused = std::get_if<Outcome>(&made)) return output_.OnOutcome(order.id, *refused);
  procedure_ = std::move(std::get<std::unique_ptr<Procedure>>(made));
  order_ = order.id;
  begin_by_ = order.begin_by;
}

Result<> SaaCanDevice::Validate(const DriverCommand& order, MonoNs now) const {
  return AsResult(RefusalOf(Admit(order, now)));
}

// What is wrong with the order itself comes first: it will not pass.
Made<Procedure> SaaCanDevice::Admit(const DriverCommand& order, MonoNs now) const {
  auto made = MakeProcedure(order, {settings_, bench_, interpreter_, output_}, now);
  if (RefusalOf(made)) return made;
  if (auto refusal = RefusalNow(order, now)) return *std::move(refusal);
  return made;
}

std::optional<Outcome> SaaCanDevice::RefusalNow(const DriverCommand& order, MonoNs now) const {
  if (auto refusal = RefusalToBegin(procedure_ != nullptr, order, now, link_up_)) return refusal;
  if (silenced_) {
    return Rejected(Reason::REASON_DEVICE_OFFLINE,
                    "the encoder may run at another bit rate since set_bitrate: set the interface to it");
  }
  if (!interpreter_.answering() && !LooksElsewhere(order)) {
    return Rejected(Reason::REASON_DEVICE_OFFLINE,
                    "the encoder is not heard: check its power, its cable, node id and bit rate");
  }
  const OperationSpec* spec = FindOperation(order.operation);
  if (spec == nullptr || !spec->needs_standstill) return std::nullopt;
  const Motion motion = output_.MotionAt(now);
  if (auto refusal = RefusalInMotion(motion)) return refusal;
  return RefusalAtPosition(order.operation, motion.counts, settings_);
}

bool SaaCanDevice::Cancel(const CommandId& id, MonoNs) {
  if (!procedure_ || id != order_ || procedure_->touched()) return false;
  procedure_.reset();
  return true;
}

void SaaCanDevice::Report(const std::optional<Outcome>& outcome) {
  if (!outcome) return;
  output_.OnOutcome(order_, *outcome);
  if (!outcome->IsFinal()) return;
  silenced_ = silenced_ || (link_up_ && procedure_->silences());
  procedure_.reset();
}

}  // namespace axlecast::saa_can
