#include "drivers/tformat/readout.h"

#include <axlecast/command_status_t.hpp>
#include <utility>

#include "core/device/operation.h"
#include "drivers/kit/read_back.h"
#include "drivers/tformat/alarms.h"
#include "drivers/tformat/cell_reader.h"
#include "drivers/tformat/operations.h"
#include "drivers/tformat/reset_rules.h"

namespace axlecast::tformat {

Readout::Readout(DataId id, std::string after, const TFormatSettings& settings, const DeviceOutput& output)
    : id_(id), after_(std::move(after)), settings_(settings), output_(output) {}

Step Readout::Next(MonoNs) const { return CommandStep(Ask(id_, settings_.timeout)); }

std::optional<Outcome> Readout::OnAnswer(const Answer& answer, MonoNs end) {
  // An encoder of another model is what read_identity is asked about.
  const bool identity = id_ == DataId::kEncoderId && answer.error == ErrorKind::kWrongIdentity;
  if (!answer.ok() && !identity) {
    if (++failures_ < kTries) return std::nullopt;
    return Final(CommandState::kFailed, command_status_t::REASON_NO_REPLY,
                 Text("the reading failed %d times (%s)", failures_, ErrorName(*answer.error)));
  }
  end_ = end;
  return Show(answer.reply);
}

Outcome Readout::OnLinkLost() const {
  return Final(CommandState::kFailed, command_status_t::REASON_NO_REPLY,
               "the link was lost before the reading came");
}

Outcome Readout::Show(const Reply& reply) const {
  if (id_ == DataId::kAll) return ShowAll(reply);
  Outcome outcome;
  if (id_ == DataId::kEncoderId) {
    outcome = Verified(Text("encoder ID 0x%02X, model %s has 0x%02X", unsigned{*reply.encoder_id},
                            settings_.model.c_str(), unsigned{settings_.encoder_id}));
    outcome.changes.push_back({"encoder_id", "", Text("0x%02X", unsigned{*reply.encoder_id})});
  } else {
    outcome = Verified(Text("turns %u", *reply.multi_turn));
    outcome.changes.push_back({"turns", "", std::to_string(*reply.multi_turn)});
  }
  return outcome;
}

Outcome Readout::ShowAll(const Reply& reply) const {
  Outcome outcome = Verified(
      Text("single-turn %u (%.4f deg), turns %u, encoder ID 0x%02X, SF 0x%02X, ALMC %s", *reply.single_turn,
           Degrees(*reply.single_turn, settings_.format.single_turn_bits), *reply.multi_turn,
           unsigned{*reply.encoder_id}, unsigned{*reply.status}, AlarmText(*reply.alarms).c_str()));
  outcome.changes.push_back({"single_turn", "", std::to_string(*reply.single_turn)});
  outcome.changes.push_back({"turns", "", std::to_string(*reply.multi_turn)});
  outcome.changes.push_back({"alarms", "", AlarmText(*reply.alarms)});
  if (after_.empty())
    outcome.changes.push_back({"encoder_id", "", Text("0x%02X", unsigned{*reply.encoder_id})});
  else
    outcome.changes.push_back(FindingChange(Finding(reply, end_)));
  return outcome;
}

// A shaft that turns may have left the place where it was zeroed.
const char* Readout::Finding(const Reply& all, MonoNs now) const {
  const Motion motion = output_.MotionAt(now);
  const char* not_seen = motion.known && motion.standstill ? kNoEffectSeen : kCannotTell;
  const int latched = settings_.turns_range > 0 ? kLatchedAlarms : kLatchedAlarms & ~kMultiTurnAlarms;
  const bool clear = (*all.alarms & latched) == 0;
  if (after_ == kZeroSingleTurnName) return IsZero(all, settings_) ? kReadsAsAfter : not_seen;
  if (after_ == kResetTurnsName) return TurnsAreReset(all, settings_) && clear ? kReadsAsAfter : not_seen;
  return clear ? kReadsAsAfter : kNoEffectSeen;
}

}  // namespace axlecast::tformat
