#include "drivers/saa_can/readout.h"

#include <axlecast/command_status_t.hpp>

#include "core/device/operation.h"
#include "drivers/kit/read_back.h"
#include "drivers/saa_can/ending.h"

namespace axlecast::saa_can {
namespace {

using Reason = command_status_t;

Outcome NothingRead(const char* why) { return Final(CommandState::kFailed, Reason::REASON_NO_REPLY, why); }

}  // namespace

// ---- ReadPosition ----

ReadPosition::ReadPosition(After after, const OperationContext& around, MonoNs now)
    : after_(after), around_(around), deadline_(now + Patience(around.settings)) {}

std::optional<Outcome> ReadPosition::On(const Event&, const Interpreter::Heard& heard, MonoNs now) {
  if (heard.reading && !heard.reading->error) {
    const std::int64_t counts = heard.reading->counts;
    Outcome outcome = Verified("the position is " + PositionText(counts, around_.settings.format.bits));
    outcome.changes.push_back({"single_turn", "", std::to_string(counts)});
    if (after_ != After::kNothing) outcome.changes.push_back(FindingChange(Finding(counts, now)));
    return outcome;
  }
  if (now < deadline_) return std::nullopt;
  return NothingRead("no position came in time");
}

// A shaft that turns may have left the place where it was zeroed; a direction does not show at rest; an encoder that is
// heard at the present bit rate was not given another one, or has not taken it up yet.
const char* ReadPosition::Finding(std::int64_t counts, MonoNs now) const {
  if (after_ != After::kZero) return after_ == After::kBitrate ? kNoEffectSeen : kCannotTell;
  if (IsNearZero(counts, around_.settings)) return kReadsAsAfter;
  return AtRest(around_.output, now) ? kNoEffectSeen : kCannotTell;
}

Outcome ReadPosition::OnLinkLost() const { return NothingRead("the link was lost before a position came"); }

// ---- LookForPeriod ----

LookForPeriod::LookForPeriod(MonoNs period, const OperationContext& around, MonoNs now)
    : period_(period), deadline_(now + PeriodMeter::Patience(std::max(period, around.interpreter.period()))) {}

std::optional<Outcome> LookForPeriod::On(const Event& event, const Interpreter::Heard& heard, MonoNs now) {
  if (heard.reading) meter_.Add(event.received.first);
  if (!meter_.done() && now < deadline_) return std::nullopt;
  if (!meter_.done()) return NothingRead("too few positions came to measure their period");
  const double measured = static_cast<double>(meter_.Mean()) / static_cast<double>(kMillisecond);
  Outcome outcome = Verified(Text("a position comes every %.1f ms", measured));
  outcome.changes.push_back({"period_ms", "", Text("%.1f", measured)});
  outcome.changes.push_back(FindingChange(FindingWord(meter_.Fits(period_))));
  return outcome;
}

Outcome LookForPeriod::OnLinkLost() const {
  return NothingRead("the link was lost before the period was measured");
}

// ---- LookForNode ----

LookForNode::LookForNode(std::uint8_t node, const OperationContext& around)
    : node_(node), around_(around), search_(node, around.settings.node, around.settings) {}

Procedure::Want LookForNode::Wants(MonoNs) const {
  if (const auto frame = search_.Wants()) return *frame;
  return Nothing{};
}

std::optional<Outcome> LookForNode::On(const Event& event, const Interpreter::Heard&, MonoNs now) {
  const NodeSearch::Progress progress = search_.On(event, now);
  if (progress == NodeSearch::Progress::kGoing) return std::nullopt;
  const unsigned before = around_.settings.node;
  if (progress == NodeSearch::Progress::kNowhere) {
    return NothingRead(
        Text("the encoder answers neither as node 0x%02X nor as 0x%02X", unsigned{node_}, before).c_str());
  }
  const bool changed = progress == NodeSearch::Progress::kFirst;
  const unsigned found = changed ? node_ : before;
  Outcome outcome = Verified(Text("the encoder answers as node 0x%02X", found));
  if (changed) outcome.text += Text(": put node: 0x%02x into the file and restart the driver", found);
  outcome.changes.push_back({"node", "", Text("0x%02x", found)});
  outcome.changes.push_back(FindingChange(FindingWord(changed)));
  return outcome;
}

Outcome LookForNode::OnLinkLost() const { return NothingRead("the link was lost before the encoder answered"); }

}  // namespace axlecast::saa_can
