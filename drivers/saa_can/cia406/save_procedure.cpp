#include "drivers/saa_can/cia406/save_procedure.h"

#include <axlecast/command_status_t.hpp>

#include "core/device/operation.h"
#include "drivers/saa_can/cia406/objects.h"

namespace axlecast::saa_can::cia406 {
namespace {

using Reason = command_status_t;
using Kind = SdoResult::Kind;

constexpr MonoNs kPatience = 2 * kSecond;
// Beyond the time that the client gives a save.
constexpr MonoNs kSavePatience = 10 * kSecond;

}  // namespace

SaveProcedure::SaveProcedure(const Cia406Settings& settings, MonoNs now)
    : deadline_(now + kPatience + 4 * settings.sdo_timeout) {}

std::optional<SdoRequest> SaveProcedure::Wants(MonoNs) const {
  if (stage_ == Stage::kAsk) return SdoRequest{.object = kStoreAll, .write = {}};
  if (stage_ == Stage::kSend) return SdoRequest{.object = kStoreAll, .write = kSaveSignature};
  return std::nullopt;
}

void SaveProcedure::OnStarted(const SdoRequest& request, MonoNs now) {
  if (!request.write) return;
  stage_ = Stage::kSent;
  deadline_ = now + kSavePatience;
}

void SaveProcedure::OnNotSent() {
  if (stage_ == Stage::kSent) stage_ = Stage::kSend;
}

std::optional<Outcome> SaveProcedure::OnResult(const SdoResult& result) {
  if (result.request.object != kStoreAll) return std::nullopt;
  if (stage_ == Stage::kSent) return OnSaved(result);
  return result.kind == Kind::kTimedOut ? OnTime(result.received.last) : OnAsked(result);
}

std::optional<Outcome> SaveProcedure::OnAsked(const SdoResult& result) {
  if (result.kind == Kind::kValue && (result.value & kSavesOnCommand) != 0) {
    stage_ = Stage::kSend;
    return std::nullopt;
  }
  return Rejected(Reason::REASON_DEVICE_REFUSED, "the encoder does not store parameters on command (1010h sub 1)");
}

Outcome SaveProcedure::OnSaved(const SdoResult& result) {
  if (result.kind == Kind::kWritten) {
    return Succeeded(false,
                     "the encoder confirms that it has stored its parameters; what is stored cannot be read");
  }
  if (result.kind == Kind::kAborted) {
    return Final(
        CommandState::kFailed, Reason::REASON_DEVICE_REFUSED,
        Text("the encoder did not store its parameters: %s (0x%08X)", AbortText(result.value), result.value));
  }
  return Final(
      CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
      "the encoder did not confirm in time that it has stored its parameters; nothing shows whether it has");
}

std::optional<Outcome> SaveProcedure::OnTime(MonoNs now) {
  if (now < deadline_) return std::nullopt;
  if (!touched()) return Rejected(Reason::REASON_NO_REPLY, "the encoder did not answer");
  return Final(
      CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
      "the encoder started anew or fell silent while it stored its parameters; nothing shows whether it has");
}

Outcome SaveProcedure::OnLinkLost() const {
  if (!touched()) {
    return Final(CommandState::kFailed, Reason::REASON_NO_REPLY, "nothing was done: the link was lost before it");
  }
  return Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
               "the link was lost while the encoder stored its parameters; nothing shows whether it has");
}

}  // namespace axlecast::saa_can::cia406
