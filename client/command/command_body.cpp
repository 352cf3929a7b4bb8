#include "client/command/command_body.h"

#include <algorithm>
#include <axlecast/command_body_t.hpp>
#include <string_view>

#include "client/axlecast/command.h"
#include "core/base/result.h"
#include "core/base/text.h"
#include "core/command/command_id.h"
#include "core/messages/enum_names.h"
#include "core/messages/message.h"

namespace axlecast {
namespace {

constexpr std::size_t kMaxBody = 1'200;  // command_t.body_size
constexpr std::int32_t kMaxValidMs = 3'600'000;

command_body_t BodyOf(const CommandId& id) {
  command_body_t body{};
  std::copy(id.begin(), id.end(), std::begin(body.id));
  return body;
}

bool HoldsNul(std::string_view text) { return text.find('\0') != std::string_view::npos; }

using S = command_status_t;

}  // namespace

SignedBody MakeBody(const CommandId& id, const CommandRequest& request, std::int8_t mode, BridgeTimestamp bridge,
                    const ClientKeys& keys) {
  command_body_t body = BodyOf(id);
  body.bridge_boot_id = bridge.boot_id;
  body.issued_mono_ns = bridge.mono;
  body.valid_ms = request.valid_ms;
  body.device = request.device;
  body.operation = request.operation;
  body.mode = mode;
  if (request.token) std::copy(request.token->begin(), request.token->end(), std::begin(body.token));
  body.expect_epoch = request.expect_epoch;
  for (const auto& [key, value] : request.arguments) body.arguments.push_back({key, value});
  body.n_arguments = static_cast<std::int8_t>(body.arguments.size());
  body.reason = request.reason;
  body.key_id = keys.own ? KeyId(keys.own->public_key()) : 0;
  SignedBody made{Encoded(body)};
  if (keys.own) made.signature = keys.own->Sign(Domain::kCommand, made.bytes);
  return made;
}

SignedBody QueryBody(const CommandId& id) {
  command_body_t body = BodyOf(id);
  body.valid_ms = 1'000;
  body.mode = command_body_t::MODE_QUERY;
  body.expect_epoch = -1;
  return {Encoded(body)};
}

Result<> CheckForm(const CommandRequest& request) {
  if (request.valid_ms < 1 || request.valid_ms > kMaxValidMs) {
    return Failure("valid_ms is " + std::to_string(request.valid_ms) + ": give 1 to 3600000");
  }
  if (request.arguments.size() > kMaxArguments) return Failure("it has more than 16 arguments");
  if (request.reason.size() > kReasonBytes) return Failure("its reason is longer than 160 bytes");
  if (request.prepare && request.token)
    return Failure("it prepares and commits at once: send the token without prepare");
  bool nul = HoldsNul(request.device) || HoldsNul(request.operation) || HoldsNul(request.reason);
  for (const auto& [key, value] : request.arguments) nul = nul || HoldsNul(key) || HoldsNul(value);
  if (nul) return Failure("a text of it holds a NUL byte");
  if (MakeBody({}, request, command_body_t::MODE_EXECUTE, {}, {}).bytes.size() > kMaxBody) {
    return Failure("its texts are longer than a command carries, 1200 bytes in all");
  }
  return {};
}

CommandOutcome CommandResult::outcome() const {
  if (not_accepted) return CommandOutcome::kNotAccepted;
  if (!answered || status.is_final == 0) return CommandOutcome::kUnknown;
  switch (status.state) {
    case S::STATE_SUCCEEDED:
      if (prepare) return CommandOutcome::kPrepared;
      return status.verified != 0 ? CommandOutcome::kDone : CommandOutcome::kDoneUnverified;
    case S::STATE_REJECTED:
      return CommandOutcome::kRejected;
    case S::STATE_EXPIRED:
      return CommandOutcome::kExpired;
    case S::STATE_CANCELLED:
      return CommandOutcome::kCancelled;
    case S::STATE_FAILED:
      return CommandOutcome::kFailed;
    case S::STATE_INDETERMINATE:
      return CommandOutcome::kIndeterminate;
    default:
      return CommandOutcome::kUnknown;
  }
}

bool CommandResult::temporary() const {
  const CommandOutcome what = outcome();
  if (what == CommandOutcome::kNotAccepted) return can_resend;
  return (what == CommandOutcome::kRejected || what == CommandOutcome::kExpired) && IsTemporary(status.reason_code);
}

std::string_view CommandResult::reason() const { return ReasonName(status.reason_code); }

CommandToken CommandResult::token() const { return IdOf(status.token); }

}  // namespace axlecast
