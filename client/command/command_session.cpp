#include "tools/axlecast/command_session.h"

#include <algorithm>
#include <axlecast/command_body_t.hpp>

#include "drivers/runtime/command/body_digest.h"
#include "drivers/runtime/command/capped_text.h"
#include "drivers/runtime/command/command_words.h"
#include "drivers/runtime/command/order_ledger.h"

namespace axlecast {
namespace {

using S = command_status_t;

bool SaysTheSame(const S& one, const S& other) {
  return one.state == other.state && one.finding == other.finding && one.progress == other.progress &&
         one.text == other.text;
}

// A finding may still follow an INDETERMINATE.
bool IsComplete(const S& status) {
  return status.is_final != 0 && (status.state != S::STATE_INDETERMINATE || status.finding != S::FINDING_NONE);
}

}  // namespace

CommandSession::CommandSession(const CommandId& id, MonoNs now, MonoNs give_up)
    : next_send_(now), heard_(now), give_up_(give_up) {
  result_.id = id;
}

CommandSession::CommandSession(const CommandId& id, CommandRequest request, MonoNs now, MonoNs give_up)
    : CommandSession(id, now, give_up) {
  request_ = std::move(request);
}

CommandSession CommandSession::Query(const CommandId& id, MonoNs now, MonoNs give_up) {
  CommandSession session(id, now, give_up);
  session.only_query_ = true;
  return session;
}

void CommandSession::Cancel(MonoNs now) {
  if (cancelling_ || only_query_ || done_) return;
  cancelling_ = true;
  next_send_ = now;
  if (phase_ != Phase::kLearning) return;
  result_.answered = true;
  result_.status.device = request_.device;
  result_.status.operation = request_.operation;
  result_.status.state = S::STATE_CANCELLED;
  result_.status.is_final = 1;
  result_.status.reason_code = S::REASON_CANCELLED;
  result_.status.text = "cancelled before it was sent";
  done_ = true;
}

std::optional<std::vector<std::uint8_t>> CommandSession::Next(MonoNs now) {
  EndWhenHopeless(now);
  if (done_ || now < next_send_) return std::nullopt;
  next_send_ = now + (phase_ == Phase::kFollowing && !cancelling_ ? kAsk : kRepeat);
  if (phase_ == Phase::kSending) return Body(command_body_t::MODE_EXECUTE);
  if (phase_ == Phase::kFollowing && cancelling_) return Body(command_body_t::MODE_CANCEL);
  return Body(command_body_t::MODE_QUERY);
}

bool CommandSession::OnStatus(const command_status_t& status, MonoNs now) {
  if (done_ || IdOf(status.id) != result_.id) return false;
  if (phase_ == Phase::kLearning) {
    bridge_boot_id_ = status.boot_id;
    heard_ = now;
    if (only_query_) {
      result_.status = status;
      result_.answered = true;
      done_ = true;
      if (status.state == S::STATE_UNKNOWN)
        End("the bridge does not know this id: it restarted since, or the "
            "command never reached it; look at the device");
      return true;
    }
    digest_ = BodyDigest(Body(command_body_t::MODE_EXECUTE));
    phase_ = Phase::kSending;
    next_send_ = now;
    return false;
  }
  if (status.boot_id != bridge_boot_id_) {
    other_bridge_ = true;
    return false;
  }
  heard_ = now;
  return status.body_digest == digest_ && Follow(status, now);
}

bool CommandSession::Follow(const command_status_t& status, MonoNs now) {
  // A late message does not take an outcome back.
  if (result_.status.is_final != 0 && (status.is_final == 0 || status.finding == S::FINDING_NONE)) return false;
  const bool news = !result_.answered || !SaysTheSame(status, result_.status);
  if (!cancelling_ || phase_ != Phase::kFollowing) next_send_ = now + (cancelling_ ? 0 : kAsk);
  phase_ = Phase::kFollowing;
  result_.answered = true;
  result_.status = status;
  done_ = IsComplete(status);
  return news;
}

void CommandSession::EndWhenHopeless(MonoNs now) {
  if (done_) return;
  const bool silent = now - heard_ > kBridgeSilence;
  if (!silent && now < give_up_) return;
  if (result_.status.is_final != 0) {
    done_ = true;  // an INDETERMINATE whose finding did not come
    return;
  }
  if (phase_ == Phase::kLearning) {
    return End("no bridge answers on the command port: start axlecast-bridge (or axlecast up); nothing was sent");
  }
  if (silent && other_bridge_) {
    return End("the bridge restarted and does not know this command: look at the device before you send it again");
  }
  if (silent) return End("the bridge fell silent: ask for this id later, and look at the device");
  if (!result_.answered) return End("no status came in time: ask for this id later, and look at the device");
  End("it is " + std::string(StateName(result_.status.state)) + " still: ask for this id later");
}

void CommandSession::End(std::string problem) {
  result_.problem = std::move(problem);
  done_ = true;
}

std::vector<std::uint8_t> CommandSession::Body(std::int8_t mode) const {
  command_body_t body{};
  std::copy(result_.id.begin(), result_.id.end(), std::begin(body.id));
  body.bridge_boot_id = mode == command_body_t::MODE_QUERY ? 0 : bridge_boot_id_;
  body.valid_ms = request_.valid_ms;
  body.device = request_.device;
  body.operation = request_.operation;
  body.mode = mode;
  body.expect_epoch = request_.expect_epoch;
  for (const auto& [key, value] : request_.arguments) body.arguments.push_back({key, value});
  body.n_arguments = static_cast<std::int8_t>(body.arguments.size());
  body.reason = CappedText(request_.reason, kReasonBytes);
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(body.getEncodedSize()));
  body.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

}  // namespace axlecast
