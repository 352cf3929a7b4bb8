#include "drivers/saa_can/zero.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <utility>

#include "core/device/operation.h"
#include "drivers/kit/read_back.h"
#include "drivers/kit/refusal.h"
#include "drivers/saa_can/ending.h"

namespace axlecast::saa_can {
namespace {

using Reason = command_status_t;

// A shaft that is held, and an encoder that takes its time.
constexpr int kMaxLooks = 5;

}  // namespace

Zero::Zero(const OperationContext& around, MonoNs now)
    : around_(around), deadline_(now + Patience(around.settings)) {}

Procedure::Want Zero::Wants(MonoNs now) const {
  switch (stage_) {
    case Stage::kReadBefore:
      return Position{};
    case Stage::kSend:
      if (AtRest(around_.output, now)) return CommandFrame(Command::kZero, around_.settings.node);
      return Position{};
    case Stage::kDeliver:
      return Nothing{};
    default:
      return now < around_.interpreter.effect_from() ? Want(Nothing{}) : Want(Position{});
  }
}

MonoNs Zero::Due(MonoNs now) const {
  if (stage_ == Stage::kDeliver) return delivery_.due();
  const MonoNs effect_from = around_.interpreter.effect_from();
  return stage_ == Stage::kVerify && now < effect_from ? std::min(effect_from, deadline_) : deadline_;
}

void Zero::OnStarted(const CanFrame& frame) {
  stage_ = Stage::kDeliver;
  delivery_.Start(frame);
}

std::optional<Outcome> Zero::On(const Event& event, const Interpreter::Heard& heard, MonoNs now) {
  if (touched() && heard.acknowledged == Command::kZero) acknowledged_ = true;
  switch (stage_) {
    case Stage::kReadBefore:
    case Stage::kSend:
      return OnBefore(heard, now);
    case Stage::kDeliver:
      return OnDelivery(event, now);
    default:
      return OnVerify(heard, now);
  }
}

std::optional<Outcome> Zero::OnBefore(const Interpreter::Heard& heard, MonoNs now) {
  if (heard.reading && !heard.reading->error) {
    if (!AtRest(around_.output, now)) {
      return Rejected(Reason::REASON_NOT_STANDING_STILL, MotionText(around_.output.MotionAt(now)));
    }
    before_ = heard.reading->counts;
    stage_ = Stage::kSend;
    return std::nullopt;
  }
  if (now < deadline_) return std::nullopt;
  return Rejected(Reason::REASON_NO_REPLY, "no position came to begin with");
}

std::optional<Outcome> Zero::OnDelivery(const Event& event, MonoNs now) {
  delivery_.On(event, now);
  if (auto failed = NotDelivered(delivery_, around_.settings)) return WithCounts(std::move(*failed), "");
  if (delivery_.state() != Delivery::State::kOnBus) return std::nullopt;
  stage_ = Stage::kVerify;
  deadline_ = now + around_.settings.zero_settle + Patience(around_.settings);
  Outcome running;
  running.text = "the command was on the bus; waiting for a position that shows its effect";
  running.progress = 0.5F;
  // Should this process die: what is found afterwards says something only beside what was before.
  return WithCounts(std::move(running), "");
}

std::optional<Outcome> Zero::OnVerify(const Interpreter::Heard& heard, MonoNs now) {
  const auto& reading = heard.reading;
  if (reading && !reading->error && reading->at.first >= around_.interpreter.effect_from()) {
    if (IsNearZero(reading->counts, around_.settings) || ++looks_ >= kMaxLooks) return Judge(reading->counts);
  }
  if (now < deadline_) return std::nullopt;
  return WithCounts(
      Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
            "the command was on the bus, but no position came that shows its effect: read_position when "
            "the encoder is heard again"),
      "");
}

Outcome Zero::Judge(std::int64_t counts) const {
  const int bits = around_.settings.format.bits;
  const std::string reply = acknowledged_ ? "its reply came" : "no reply came";
  const std::string text =
      "the position was " + PositionText(before_, bits) + " and is " + PositionText(counts, bits);
  const std::string after = std::to_string(counts);
  if (!IsNearZero(counts, around_.settings)) {
    return WithCounts(
        Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS, reply + ", but " + text + ", not 0"), after);
  }
  const bool may_be_position = LooksLikeReply(before_, Command::kZero, around_.settings);
  const std::string heard = may_be_position && acknowledged_ ? "what came as its reply may be a position" : reply;
  const ReadBack read_back = {.same_before = SameBefore(), .confirmed = acknowledged_ && !may_be_position};
  return WithCounts(JudgeReadBack(read_back, text + "; " + heard), after);
}

bool Zero::SameBefore() const {
  return CannotBeToldApart(before_, 0, ZeroToleranceCounts(around_.settings.format.bits),
                           around_.settings.counts_per_turn);
}

Outcome Zero::OnLinkLost() const {
  return touched() ? WithCounts(LinkLost(true, "read_position after=zero"), "") : LinkLost(false, "");
}

Outcome Zero::WithCounts(Outcome outcome, const std::string& after) const {
  outcome.changes.push_back({"single_turn", std::to_string(before_), after});
  return WithFindingBefore(std::move(outcome), SameBefore());
}

}  // namespace axlecast::saa_can
