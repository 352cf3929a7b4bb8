#include "drivers/saa_can/device.h"

#include <algorithm>
#include <utility>

#include "core/device/operation.h"
#include "drivers/saa_can/operations.h"

namespace axlecast::saa_can {
namespace {

// After this time, an own frame that no node has acknowledged no longer delays the next one.
constexpr MonoNs kStale = kSecond;
constexpr MonoNs kAfterFullQueue = 100 * kMillisecond;
// The intervals at which a silent encoder is started again, and at which a lost one is asked again.
constexpr MonoNs kStartAgain = kSecond;
constexpr MonoNs kAskGone = 250 * kMillisecond;
constexpr int kGone = 4;  // requests in a row without an answer

Step Sending(const CanFrame& frame, Priority priority) { return {.action = Send{frame}, .priority = priority}; }

}  // namespace

SaaCanDevice::SaaCanDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output)
    : owned_(device.settings),
      settings_(Own(device)),
      bench_(OwnBus(bus).bench),
      output_(output),
      interpreter_(settings_, bus.late, output),
      runner_(Operations(), *this, output) {}

// ---- the next step ----

MonoNs SaaCanDevice::FreeAt() const {
  return std::max(not_before_, interpreter_.unconfirmed() ? sent_at_ + kStale : 0);
}

Step SaaCanDevice::Next(const BusSlot& slot) const {
  if (!link_up_ || silenced_) return {.action = Idle{kNever}, .priority = Priority::kLive};
  if (slot.now < FreeAt()) return Listening(slot);
  if (const auto step = ForProcedure(slot)) return *step;
  if (ProcedureAlone()) return Listening(slot);
  if (const auto frame = SetUp(slot.now)) return Sending(*frame, Priority::kLive);
  const bool ask = settings_.mode == Mode::kSingle && slot.poll_due && slot.now >= PollAt();
  return ask ? Sending(Poll(), Priority::kLive) : Listening(slot);
}

std::optional<Step> SaaCanDevice::ForProcedure(const BusSlot& slot) const {
  const Procedure* procedure = runner_.Runnable(slot.now);
  if (procedure == nullptr || (slot.reserved && !procedure->alone())) return std::nullopt;
  const Procedure::Want want = procedure->Wants(slot.now);
  if (const auto* frame = std::get_if<CanFrame>(&want)) return Sending(*frame, Priority::kCommand);
  const bool asks = std::holds_alternative<Procedure::Position>(want) && settings_.mode == Mode::kSingle;
  if (!asks || interpreter_.awaiting()) return std::nullopt;
  return Sending(Poll(), slot.poll_due ? Priority::kLive : Priority::kCommand);
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

// An encoder that was switched off and on may have to be started again. The answer to 01 NN also contains a position.
CanFrame SaaCanDevice::Poll() const {
  const int silent = interpreter_.silent_in_a_row();
  const bool start = settings_.start && (to_start_ || (silent > 0 && silent % 2 == 0));
  return CommandFrame(start ? Command::kStart : Command::kRead, settings_.node);
}

// Listens until a position is overdue, a frame may be sent, or the procedure has a deadline.
Step SaaCanDevice::Listening(const BusSlot& slot) const {
  MonoNs until = interpreter_.due();
  if (slot.now < FreeAt()) {
    until = std::min(until, FreeAt());
  } else if (!ProcedureAlone()) {
    if (settings_.mode == Mode::kSingle && slot.poll_due) until = std::min(until, PollAt());
    const bool again = settings_.mode == Mode::kCyclic && settings_.start && interpreter_.silent_in_a_row() > 0;
    if (again) until = std::min(until, sent_at_ + kStartAgain);
  }
  if (runner_.busy()) until = std::min({until, runner_.procedure().Due(slot.now), runner_.ExpiresAt()});
  return {.action = Listen{std::max(until, slot.now)}, .priority = Priority::kLive};
}

void SaaCanDevice::OnStarted(const Step& step, MonoNs now) {
  runner_.ExpireIfLate(now);
  const auto* send = std::get_if<Send>(&step.action);
  if (!runner_.busy() || send == nullptr || step.priority != Priority::kCommand) return;
  // A request for a position is not a frame of the procedure. touched() alone decides whether the command can expire.
  Procedure& procedure = runner_.procedure();
  if (std::holds_alternative<CanFrame>(procedure.Wants(now))) procedure.OnStarted(send->frame);
}

// ---- events ----

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
  runner_.OnLinkLost();
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
  if (!runner_.busy() || runner_.ExpireIfLate(now)) return;
  Report(runner_.procedure().On(event, heard, now));
}

// ---- commands ----

Result<std::unique_ptr<Procedure>> SaaCanDevice::MakeProcedure(const DriverCommand& command, MonoNs now) const {
  return saa_can::MakeProcedure(command, {settings_, bench_, interpreter_, output_}, now);
}

Result<> SaaCanDevice::CheckState(const DriverCommand& command, MonoNs) const {
  if (silenced_) {
    return DeviceOffline("the encoder may run at another bit rate since set_bitrate: set the interface to it");
  }
  if (interpreter_.answering() || LooksElsewhere(command)) return {};
  return DeviceOffline("nothing is received from the encoder: check its power, its cable, node id and bit rate");
}

Result<> SaaCanDevice::CheckPosition(const DriverCommand& command, const Motion& motion) const {
  return saa_can::CheckPosition(command.operation, motion.counts, settings_);
}

void SaaCanDevice::Report(const std::optional<Outcome>& outcome) {
  const bool silences = runner_.busy() && runner_.procedure().silences();
  if (runner_.Report(outcome) && silences) silenced_ = true;
}

}  // namespace axlecast::saa_can
