#include "client/command/signed_messages.h"

#include <algorithm>
#include <axlecast/command_body_t.hpp>
#include <string_view>

#include "client/axlecast/permit_issuer.h"
#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/command/commands.h"
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

constexpr std::size_t kLongestPermitName = 64;
constexpr std::size_t kMaxPermit = 1'200;  // permit_t.permit_size

bool IsPermitName(const std::string& text) {
  return !text.empty() && text.size() <= kLongestPermitName && !HoldsNul(text);
}

}  // namespace

Result<ClientKeys> LoadClientKeys(const ClientSettings& settings, SecretSource& secrets) {
  ClientKeys keys;
  if (!settings.bridge_key.empty()) {
    keys.bridge = ParsePublicKey(settings.bridge_key);
    if (!keys.bridge) return Failure("the bridge's key " + Quoted(settings.bridge_key) + " is not 64 hex digits");
  }
  if (!settings.key_file.empty()) {
    Result<SigningKey> own = LoadKeyFile(settings.key_file, secrets);
    if (!own) return Failure(own.error());
    keys.own = std::make_shared<const SigningKey>(std::move(*own));
  } else if (!settings.key_credential.empty()) {
    OwnKey place;
    place.place.credential = settings.key_credential;
    Result<std::optional<SigningKey>> own = LoadKey(place, secrets);
    if (!own) return Failure(own.error());
    if (*own) keys.own = std::make_shared<const SigningKey>(std::move(**own));
  }
  return keys;
}

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

permit_t MakePermit(permit_body_t body, const SigningKey* key) {
  body.n_operations = static_cast<std::int8_t>(body.operations.size());
  body.key_id = key != nullptr ? KeyId(key->public_key()) : 0;
  permit_t permit{};
  permit.permit = Encoded(body);
  permit.permit_size = static_cast<std::int16_t>(permit.permit.size());
  if (key == nullptr) return permit;
  const Signature signature = key->Sign(Domain::kPermit, permit.permit);
  std::copy(signature.begin(), signature.end(), std::begin(permit.sig));
  return permit;
}

bool FitsPermit(const std::string& device, const std::vector<std::string>& operations) {
  if (!IsPermitName(device) || operations.size() > PermitIssuer::kMaxOperations) return false;
  if (!std::all_of(operations.begin(), operations.end(), IsPermitName)) return false;
  permit_body_t body{};
  body.device = device;
  body.operations = operations;
  body.n_operations = static_cast<std::int8_t>(operations.size());
  return static_cast<std::size_t>(body.getEncodedSize()) <= kMaxPermit;
}

}  // namespace axlecast
