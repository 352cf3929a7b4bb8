#include "drivers/tformat/identity_check.h"

#include <algorithm>

#include "core/device/operation.h"
#include "drivers/tformat/alarms.h"

namespace axlecast::tformat {

IdentityCheck::IdentityCheck(const TFormatSettings& settings, DeviceOutput& output)
    : settings_(settings), output_(output), tag_(settings.identity ? settings.identity->bytes.size() : 0) {}

void IdentityCheck::Forget() {
  state_ = State::kUnknown;
  wrong_ids_ = 0;
  wrong_tags_ = 0;
}

void IdentityCheck::OnEncoderId(std::uint8_t encoder_id, MonoNs now) {
  if (encoder_id == settings_.encoder_id) {
    wrong_ids_ = 0;
    Identify(encoder_id);
    const bool recheck = state_ == State::kWrongUnit && now - refused_at_ >= kRecheck;
    if (state_ != State::kUnknown && state_ != State::kWrongModel && !recheck) return;
    if (tag_.empty())
      Accept(now);
    else
      ReadTag();
    return;
  }
  if (encoder_id != wrong_id_) wrong_ids_ = 0;
  wrong_id_ = encoder_id;
  if (++wrong_ids_ != kConfirmations) return;
  state_ = State::kWrongModel;
  Identify(encoder_id);
  Refuse(Text("encoder ID 0x%02X answers, model %s has 0x%02X: check which encoder is connected, and the key model",
              unsigned{encoder_id}, settings_.model.c_str(), unsigned{settings_.encoder_id}),
         now);
}

void IdentityCheck::OnCell(std::uint8_t address, std::uint8_t data, MonoNs now) {
  if (!settings_.identity || address < settings_.identity->address) return;
  const auto index = static_cast<std::size_t>(address - settings_.identity->address);
  if (index >= tag_.size()) return;
  tag_[index] = data;
  if (state_ == State::kReadingTag || state_ == State::kAccepted) JudgeTag(now);
}

std::optional<std::uint8_t> IdentityCheck::WantedCell() const {
  if (state_ != State::kReadingTag) return std::nullopt;
  const auto missing = std::find(tag_.begin(), tag_.end(), std::nullopt);
  if (missing == tag_.end()) return std::nullopt;
  return static_cast<std::uint8_t>(settings_.identity->address + (missing - tag_.begin()));
}

void IdentityCheck::Identify(std::uint8_t encoder_id) {
  if (reported_id_ != encoder_id) output_.OnIdentity(encoder_id, "", "");
  reported_id_ = encoder_id;
}

void IdentityCheck::JudgeTag(MonoNs now) {
  std::vector<std::uint8_t> found;
  for (const auto& byte : tag_) {
    if (!byte) return;
    found.push_back(*byte);
  }
  if (found == settings_.identity->bytes) {
    wrong_tags_ = 0;
    if (state_ != State::kAccepted) Accept(now);
    return;
  }
  if (++wrong_tags_ < kConfirmations) return ReadTag();
  state_ = State::kWrongUnit;
  refused_at_ = now;
  Refuse(Text("EEPROM %u holds %s, the configured identity is %s: another unit is connected",
              unsigned{settings_.identity->address}, HexText(found).c_str(),
              HexText(settings_.identity->bytes).c_str()),
         now);
}

void IdentityCheck::ReadTag() {
  state_ = State::kReadingTag;
  std::fill(tag_.begin(), tag_.end(), std::nullopt);
  if (!refused_) output_.OnStarting("reading the identity tag in the encoder's EEPROM");
}

void IdentityCheck::Accept(MonoNs now) {
  state_ = State::kAccepted;
  output_.OnAlarm(kWrongIdentity, AlarmState::kAbsent, now);
  if (refused_) output_.OnJump();  // an encoder was exchanged
  refused_ = false;
}

void IdentityCheck::Refuse(std::string_view reason, MonoNs now) {
  refused_ = true;
  output_.OnRefused(reason);
  output_.OnAlarm(kWrongIdentity, AlarmState::kLive, now);
}

}  // namespace axlecast::tformat
